// Frames: columns as views of the point set's memory.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bindings/scene/scene_data.h"
#include "bindings/scene/scene_inside.h"
#include "bindings/scene/state_file_io.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/compare.h"
#include "runtime/io/format.h"
#include "runtime/points/id_index.h"
#include "runtime/report/frame_profile.h"
#include "runtime/report/statistics.h"

namespace rapid {
namespace {

template <class T>
constexpr ColumnType type_in_header()
{
    if constexpr (std::is_same_v<T, float>) return ColumnType::Float;
    if constexpr (std::is_same_v<T, Vec3f>) return ColumnType::Vec3;
    if constexpr (std::is_same_v<T, std::int32_t>) return ColumnType::Int32;
    if constexpr (std::is_same_v<T, std::int64_t>) return ColumnType::Int64;
    if constexpr (std::is_same_v<T, Quatf>) return ColumnType::Quat;
    if constexpr (std::is_same_v<T, Token>) return ColumnType::String;
    if constexpr (std::is_same_v<T, std::uint8_t>) return ColumnType::UInt8;
}

template <class T>
SceneColumn view_of(std::string_view name, const Column<T>& column)
{
    const Strided<T> values = column.read();
    SceneColumn view;
    view.name = name;
    view.type = type_in_header<T>();
    view.count = column.size();
    view.components = components_of<T>;
    view.stride = values.stride * sizeof(T);
    view.data = values.data;
    return view;
}

constexpr char frame_file_type[] = "frame of a scene";

// Contents of a frame's file.
struct StoredFrame {
    std::int64_t number = 0;
    std::map<std::string, double> fps, time;
    std::map<std::string, PointSet> outputs;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(number, fps, time, outputs);
        if constexpr (Archive::is_loading::value) {
            StateReader::expect(!outputs.empty());
            for (const auto& [name, points] : outputs) StateReader::expect(fps.contains(name) && time.contains(name));
        }
    }
};

SceneError unknown_name(const char* what, std::string_view name, const std::vector<std::string>& names)
{
    return wrong_call(fmt::format("the frame has no {} \"{}\"{}", what, name, did_you_mean(name, names)));
}

// Copies the figures for which the summary has a member of the same name and type.
template <class Summary>
void copy_by_name(Summary& to, const FrameFigures& all)
{
#define RAPID_FIGURE(type, name, ...) \
    if constexpr (requires { requires std::is_same_v<decltype(to.name), type>; }) to.name = all.name;
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
}

template <class Map>
std::vector<std::string> keys_of(const Map& map)
{
    std::vector<std::string> keys;
    for (const auto& entry : map) keys.push_back(entry.first);
    return keys;
}

}  // namespace

std::string SceneFrame::Data::first_output() const
{
    return result.outputs.contains("main") ? "main" : result.outputs.begin()->first;
}

SceneFrame::SceneFrame(std::shared_ptr<const Data> data, std::string output)
    : data_(std::move(data)), output_(std::move(output))
{
}

std::int64_t SceneFrame::number() const { return data_->result.frame; }
double SceneFrame::time() const { return data_->result.time.at(output_); }
double SceneFrame::fps() const { return data_->result.fps.at(output_); }
std::vector<std::string> SceneFrame::outputs() const { return keys_of(data_->result.outputs); }
std::size_t SceneFrame::size() const { return data_->result.outputs.at(output_).size(); }
std::vector<std::string> SceneFrame::columns() const { return data_->result.outputs.at(output_).column_names(); }
std::vector<std::string> SceneFrame::groups() const { return data_->result.outputs.at(output_).group_names(); }
std::vector<std::string> SceneFrame::warnings() const { return data_->warnings; }

Result<SceneFrame> SceneFrame::output(std::string_view name) const
{
    const auto found = data_->result.outputs.find(std::string(name));
    if (found == data_->result.outputs.end()) return unknown_name("output", name, outputs());
    return SceneFrame(data_, found->first);
}

Result<SceneColumn> SceneFrame::column(std::string_view name) const
{
    const PointSet& points = data_->result.outputs.at(output_);
    const auto found = points.columns().find(name);
    if (found == points.columns().end()) return unknown_name("column", name, columns());
    return std::visit([&](const auto& column) { return view_of(found->first, column); }, found->second);
}

Result<SceneColumn> SceneFrame::group(std::string_view name) const
{
    const PointSet& points = data_->result.outputs.at(output_);
    const auto found = points.groups().find(name);
    if (found == points.groups().end()) return unknown_name("group", name, groups());
    return view_of(found->first, found->second);
}

Result<SceneColumn> SceneFrame::expanded(std::string_view name) const
{
    Result<SceneColumn> view = column(name);
    if (!view || view->stride != 0 || view->count == 0) return view;
    try {
        const std::lock_guard lock(data_->mutex);
        const auto [entry, fresh] = data_->expanded.try_emplace(fmt::format("{}/{}", output_, name));
        if (fresh) try {
                entry->second = *data_->result.outputs.at(output_).find(name);
                std::visit([](auto& column) { column.write(); }, entry->second);
            } catch (...) {
                data_->expanded.erase(entry);
                throw;
            }
        return std::visit([&](const auto& column) { return view_of(view->name, column); },
                          std::as_const(entry->second));
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<std::vector<std::uint32_t>> SceneFrame::indices(const std::vector<std::int64_t>& ids) const
{
    static_assert(no_index == IdIndex::none);
    try {
        const IdIndex index(data_->result.outputs.at(output_).id());
        std::vector<std::uint32_t> indices(ids.size());
        std::transform(ids.begin(), ids.end(), indices.begin(), [&](std::int64_t id) { return index[id]; });
        return indices;
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

std::size_t SceneInside::bytes(const SceneFrame& frame)
{
    std::size_t bytes = 0;
    for (const auto& [name, points] : frame.data_->result.outputs) bytes += points.bytes();
    return bytes;
}

Result<std::string_view> SceneFrame::text_of(std::uint32_t token)
{
    try {
        return token_of_number(token).text();
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<std::uint32_t> SceneFrame::token_of(std::string_view text)
{
    try {
        return rapid::token_of(text).number;
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

SceneValue value_of(const DetailValue& detail)
{
    if (const auto* number = std::get_if<double>(&detail)) return *number;
    const Vec3d& vector = std::get<Vec3d>(detail);
    return std::array<double, 3>{vector[0], vector[1], vector[2]};
}

std::vector<std::string> SceneFrame::details() const { return keys_of(data_->result.outputs.at(output_).details); }

Result<SceneValue> SceneFrame::detail(std::string_view name) const
{
    const auto& all = data_->result.outputs.at(output_).details;
    const auto found = all.find(std::string(name));
    if (found == all.end()) return unknown_name("detail value", name, details());
    return value_of(found->second);
}

FrameStatisticsSummary SceneFrame::statistics() const
{
    const FrameFigures all = statistics_of(data_->result);
    FrameStatisticsSummary summary;
    copy_by_name(summary, all);
    if (const auto& error = all.error.summary) {
        summary.has_errors = true;
        summary.error_p50 = error->p50;
        summary.error_p95 = error->p95;
        summary.error_max = error->max;
    }
    summary.seconds = all.seconds.total();
    summary.script_seconds = all.seconds.script;
    summary.solve_seconds = all.seconds.solve;
    return summary;
}

std::string SceneFrame::statistics_json() const
{
    const std::string line = json_line(statistics_of(data_->result), true, data_->errors.get());
    const std::size_t begin = line.find('{'), end = line.rfind('}');
    return line.substr(begin, end - begin + 1);
}

std::string SceneFrame::profile_json() const { return rapid::profile_json(data_->result); }

Result<SceneFrame> SceneInside::without_statistics(const SceneFrame& frame)
{
    try {
        auto data = std::make_shared<SceneFrame::Data>();
        data->result.frame = frame.data_->result.frame;
        data->result.outputs = frame.data_->result.outputs;  // columns are shared
        data->result.fps = frame.data_->result.fps;
        data->result.time = frame.data_->result.time;
        data->scene = frame.data_->scene;
        return SceneFrame(std::move(data), frame.output_);
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<Done> SceneFrame::write(const std::string& path) const
{
    try {
        FrameInfo info;
        info.number = static_cast<int>(number());
        info.time = time();
        info.fps = fps();
        write_points(path, data_->result.outputs.at(output_), info);
        return Done();
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<SceneFrame> SceneFrame::read(const std::string& path)
{
    try {
        auto data = std::make_shared<Data>();
        const SkippedContents skipped;
        data->result.outputs.emplace("main", read_points(path));
        data->result.fps.emplace("main", FrameInfo().fps);
        data->result.time.emplace("main", 0);
        data->warnings = skipped.list();
        return SceneFrame(std::move(data), "main");
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<Done> SceneInside::save(const SceneFrame& frame, const std::string& path, const std::string& key)
{
    return with_file_name(path, [&] {
        const FrameResult& result = frame.data_->result;
        write_state_file(path, frame_file_type, key,
                         StoredFrame{result.frame, result.fps, result.time, result.outputs});
        return Done();
    });
}

Result<SceneFrame> SceneInside::load_frame(const std::string& path, const std::string& key)
{
    return with_file_name(path, [&] {
        auto kept = read_state_file<StoredFrame>(path, frame_file_type, key);
        auto data = std::make_shared<SceneFrame::Data>();
        data->result.frame = kept.number;
        data->result.outputs = std::move(kept.outputs);
        data->result.fps = std::move(kept.fps);
        data->result.time = std::move(kept.time);
        const std::string output = data->first_output();
        return SceneFrame(std::move(data), output);
    });
}

Result<SceneReport> SceneFrame::describe() const
{
    try {
        const PointSummary summary = rapid::describe(data_->result.outputs.at(output_));
        return SceneReport{to_text(summary), to_json(summary)};
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<FrameComparison> SceneFrame::compare(const SceneFrame& other, double tolerance) const
{
    try {
        if (!(tolerance >= 0) || !std::isfinite(tolerance))
            refuse(fmt::format("tolerance = {}; it must be a number, at least 0", tolerance));
        const Comparison found =
            rapid::compare(data_->result.outputs.at(output_), other.data_->result.outputs.at(other.output_), tolerance);
        return FrameComparison{found.same, {to_text(found), to_json(found)}};
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

}  // namespace rapid
