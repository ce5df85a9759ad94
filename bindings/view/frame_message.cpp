#include "bindings/view/frame_message.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <unordered_map>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/base/json.h"
#include "runtime/picture/tone.h"

namespace rapid {
namespace {

// Concatenates arrays and writes their offsets into the header. They are written in the buffer that is sent: a frame of
// a million points has eight megabytes, and each copy of them takes milliseconds.
class Message {
public:
    explicit Message(CheckedJson header) : header_(std::move(header)) { header_["arrays"] = CheckedJson::object(); }

    CheckedJson& header() { return header_; }

    // Adds an array that fill(std::span<T>) writes in finish().
    template <class T, class F>
    void add(const std::string& name, const char* type, std::size_t count, F fill)
    {
        header_["arrays"][name] = {{"type", type}, {"begin", size_}, {"count", count}};
        arrays_.push_back([begin = size_, count, fill = std::move(fill)](char* data) {
            fill(std::span<T>(reinterpret_cast<T*>(data + begin), count));
        });
        size_ += (count * sizeof(T) + 3) / 4 * 4;
    }

    std::string finish(std::uint32_t request) const
    {
        std::string head = json_text(header_);
        head.resize((head.size() + 3) / 4 * 4, ' ');
        const std::uint32_t words[2] = {request, static_cast<std::uint32_t>(head.size())};
        std::string all;
        all.reserve(sizeof words + head.size() + size_);
        all.append(reinterpret_cast<const char*>(words), sizeof words);
        all += head;
        all.resize(all.size() + size_);
        for (const auto& fill : arrays_) fill(all.data() + sizeof words + head.size());
        return all;
    }

private:
    CheckedJson header_;
    std::vector<std::function<void(char* data)>> arrays_;
    std::size_t size_ = 0;
};

// Maps values between low and high to whole numbers, from `first` to the largest of 16 bits. NaN and smaller values map
// to `first`.
struct WordScale {
    float low, factor, first = 0;

    WordScale(float from, float to, float least = 0)
        : low(from), factor(to > from ? (65535 - least) / (to - from) : 0), first(least)
    {
    }
    std::uint16_t operator()(float value) const
    {
        const float scaled = (value - low) * factor;
        return static_cast<std::uint16_t>(first + (scaled > 0 ? std::min(scaled + 0.5f, 65535 - first) : 0.0f));
    }
};

// Number of floats taken at once: a whole number of vectors, and of triples.
constexpr std::size_t period = 48;

// Returns the least and largest of interleaved values, such as x, y and z; 0 and 0 if none is finite.
template <std::size_t turns>
std::array<std::pair<float, float>, turns> ranges_of(std::span<const float> values)
{
    static_assert(period % turns == 0);
    constexpr float infinity = std::numeric_limits<float>::infinity();
    std::array<float, period> low, high;
    low.fill(infinity);
    high.fill(-infinity);
    // Without branches, and with separate accumulators: the loop is vectorised, 11 times as fast for a million points.
    const auto take = [&](const float* from, std::size_t count) {
        for (std::size_t j = 0; j < count; ++j) {
            const bool is_finite = std::abs(from[j]) < infinity;  // files may contain others
            low[j] = is_finite && from[j] < low[j] ? from[j] : low[j];
            high[j] = is_finite && from[j] > high[j] ? from[j] : high[j];
        }
    };
    std::size_t begin = 0;
    for (; begin + period <= values.size(); begin += period) take(values.data() + begin, period);
    take(values.data() + begin, values.size() - begin);
    std::array<std::pair<float, float>, turns> ranges;
    for (std::size_t k = 0; k < turns; ++k) {
        for (std::size_t j = k + turns; j < period; j += turns) {
            low[k] = std::min(low[k], low[j]);
            high[k] = std::max(high[k], high[j]);
        }
        ranges[k] = low[k] <= high[k] ? std::pair(low[k], high[k]) : std::pair(0.0f, 0.0f);
    }
    return ranges;
}

SceneColumn column_of(const SceneFrame& points, const std::string& name)
{
    const Result<SceneColumn> column = points.column(name);
    if (!column) throw Error(fmt::format("the points have no attribute \"{}\" here", name));
    return *column;
}

SceneColumn group_of(const SceneFrame& points, const std::string& name)
{
    const Result<SceneColumn> group = points.group(name);
    if (!group) throw Error(fmt::format("the points have no group \"{}\" here", name));
    return *group;
}

void add_positions(Message& message, const SceneFrame& points, const Indices* indices)
{
    const PointValues<float> P(column_of(points, "P"), indices);
    const std::size_t count = P.size();
    const float* const values = P[0];
    const auto ranges = ranges_of<3>({values, 3 * (P.is_one() ? std::min<std::size_t>(count, 1) : count)});
    const std::array<float, 3> low = {ranges[0].first, ranges[1].first, ranges[2].first};
    const std::array<float, 3> high = {ranges[0].second, ranges[1].second, ranges[2].second};
    message.header()["box"] = {low, high};
    message.add<std::uint16_t>("P", "u16", 3 * count, [=](std::span<std::uint16_t> to) {
        std::array<float, period> from{}, factor{};
        for (std::size_t j = 0; j < period; ++j) {
            from[j] = low[j % 3];
            factor[j] = WordScale(low[j % 3], high[j % 3]).factor;
        }
        const auto quantise = [&](const float* source, std::size_t begin, std::size_t n) {
            for (std::size_t j = 0; j < n; ++j) {
                const float scaled = (source[j] - from[j]) * factor[j] + 0.5f;
                const float bounded = scaled > 0 ? std::min(scaled, 65535.0f) : 0;  // NaN becomes 0
                to[begin + j] = static_cast<std::uint16_t>(static_cast<std::int32_t>(bounded));
            }
        };
        if (P.is_one()) {
            for (std::size_t k = 0; k < count; ++k) quantise(values, 3 * k, 3);
            return;
        }
        std::size_t begin = 0;
        for (; begin + period <= to.size(); begin += period) quantise(values + begin, begin, period);
        quantise(values + begin, begin, to.size() - begin);
    });
}

void add_velocities(Message& message, const SceneFrame& points, const Indices* indices)
{
    const PointValues<float> v(column_of(points, "v"), indices);
    float most = 0;
    for (std::size_t k = 0; k < v.size(); ++k)
        most = std::max(most, Eigen::Map<const Eigen::Vector3f>(v[k]).cwiseAbs().maxCoeff());
    message.header()["fastest"] = most;
    const float scale = most > 0 ? 32767 / most : 0;
    message.add<std::int16_t>("v", "i16", 3 * v.size(), [=](std::span<std::int16_t> to) {
        for (std::size_t k = 0; k < v.size(); ++k)
            for (std::size_t axis = 0; axis < 3; ++axis)
                to[3 * k + axis] = static_cast<std::int16_t>(std::lround(v[k][axis] * scale));
    });
}

void add_values(Message& message, const char* name, std::vector<float> values, bool is_flag = false)
{
    auto [low, high] = ranges_of<1>(values)[0];
    if (is_flag) {  // 0 and 1 keep their colours even if all points are equal
        low = std::min(low, 0.0f);
        high = std::max(high, 1.0f);
    }
    message.header()["ranges"][name] = {low, high};
    std::size_t unknown = 0;
    for (const float value : values) unknown += std::isnan(value);
    message.header()["unknown"][name] = unknown;
    // 0 is reserved for points without a value, if there are any.
    const WordScale scale(low, high, unknown > 0 ? 1 : 0);
    const std::size_t count = values.size();
    message.add<std::uint16_t>(name, "u16", count, [=, values = std::move(values)](std::span<std::uint16_t> to) {
        for (std::size_t k = 0; k < count; ++k) to[k] = scale(values[k]);
        for (std::size_t k = 0; unknown > 0 && k < count; ++k)
            if (std::isnan(values[k])) to[k] = 0;
    });
}

// Encodes linear light as pictures do (runtime/picture/tone.h): bytes at even steps of its root, finer than a byte.
class DisplayBytes {
public:
    DisplayBytes()
    {
        for (std::size_t i = 0; i < bytes_.size(); ++i) {
            const float root = static_cast<float>(i) / steps_per_unit;
            bytes_[i] = display_byte(root * root);
        }
    }
    std::uint8_t operator()(float light) const
    {
        const float bounded = light > 0 ? std::min(light, most) : 0;  // NaN becomes 0
        return bytes_[static_cast<std::size_t>(static_cast<std::int32_t>(steps_per_unit * std::sqrt(bounded) + 0.5f))];
    }

private:
    static constexpr int steps_per_unit = 8192;
    static constexpr float most = 4;  // its root is 2
    std::array<std::uint8_t, 2 * steps_per_unit + 1> bytes_;
};

void add_colours(Message& message, const SceneFrame& points, const FrameOptions& frame_options, const Indices* indices)
{
    const std::optional<SceneColumn> Cd = find_column(points, "Cd", ColumnType::Vec3);
    if (Cd && (frame_options.colour.empty() || frame_options.colour == "Cd")) {
        message.header()["colour"] = "Cd";
        const PointValues<float> from(*Cd, indices);
        message.add<std::uint8_t>("colour", "u8", 3 * from.size(), [from](std::span<std::uint8_t> to) {
            const float* const values = from[0];
            const std::size_t same = from.is_one() ? 3 : to.size();  // values that are not repeated
            static const DisplayBytes display;
            for (std::size_t j = 0; j < std::min(same, to.size()); ++j) to[j] = display(values[j]);
            for (std::size_t j = same; j < to.size(); ++j) to[j] = to[j - 3];
        });
        return;
    }
    const std::string name = frame_options.colour.empty() ? "speed" : frame_options.colour;
    message.header()["colour"] = name;
    add_values(message, "value", numbers_of(points, name, indices), name.starts_with(group_mark) || name == "asleep");
}

// Returns the alphabetical rank of each point's string among the strings of all these points.
std::vector<float> ranks_of(const PointValues<std::uint32_t>& tokens)
{
    std::unordered_map<std::uint32_t, float> ranks;
    for (std::size_t k = 0; k < tokens.size(); ++k) ranks.try_emplace(*tokens[k]);
    std::vector<std::pair<std::string_view, float*>> strings;
    for (auto& [token, rank] : ranks) strings.emplace_back(SceneFrame::text_of(token).value(), &rank);
    std::sort(strings.begin(), strings.end());
    for (std::size_t r = 0; r < strings.size(); ++r) *strings[r].second = static_cast<float>(r);
    std::vector<float> result(tokens.size());
    for (std::size_t k = 0; k < result.size(); ++k) result[k] = ranks.at(*tokens[k]);
    return result;
}

// Returns f of the components of each point.
template <class T, class F>
std::vector<float> numbers_of_each(const SceneColumn& column, const Indices* indices, const F& f)
{
    std::vector<float> numbers(indices ? indices->size() : column.count);
    for (std::size_t k = 0; k < numbers.size(); ++k)
        numbers[k] = static_cast<float>(f(column.at<T>(indices ? (*indices)[k] : k)));
    return numbers;
}

float length_of_vector(const float* vector) { return Eigen::Map<const Eigen::Vector3f>(vector).norm(); }

template <class T>
T only_component(const T* components)
{
    return *components;
}

}  // namespace

std::vector<float> numbers_of(const SceneFrame& points, const std::string& name, const Indices* indices)
{
    if (name.starts_with(group_mark))
        return numbers_of_each<std::uint8_t>(group_of(points, name.substr(group_mark.size())), indices,
                                             only_component<std::uint8_t>);
    const bool is_speed = name == "speed" && !points.column("speed");
    const SceneColumn column = column_of(points, is_speed ? "v" : name);
    switch (column.type) {
        case ColumnType::Vec3:
            return numbers_of_each<float>(column, indices, length_of_vector);
        case ColumnType::Quat:
            return numbers_of_each<float>(column, indices, [](const float* q) { return q[3]; });
        case ColumnType::Float:
            return numbers_of_each<float>(column, indices, only_component<float>);
        case ColumnType::Int32:
            return numbers_of_each<std::int32_t>(column, indices, only_component<std::int32_t>);
        case ColumnType::Int64:
            return numbers_of_each<std::int64_t>(column, indices, only_component<std::int64_t>);
        case ColumnType::UInt8:
            return numbers_of_each<std::uint8_t>(column, indices, only_component<std::uint8_t>);
        case ColumnType::String:
            return ranks_of(PointValues<std::uint32_t>(column, indices));
    }
    return {};
}

ShownPoints shown_points(const SceneFrame& points, const FrameOptions& frame_options)
{
    ShownPoints shown;
    shown.count = points.size();
    if (frame_options.group.empty() && shown.count <= frame_options.most) return shown;
    std::optional<SceneColumn> members;
    if (!frame_options.group.empty()) members = group_of(points, frame_options.group);
    Indices indices;
    for (std::uint32_t i = 0; i < shown.count; ++i)
        if (!members || *members->at<std::uint8_t>(i)) indices.push_back(i);
    // Chosen by id, so that every frame shows the same points.
    const SceneColumn id = column_of(points, "id");
    while (indices.size() > frame_options.most) {
        if (shown.every > UINT64_MAX / 2) {  // foreign files may have many points with the same id
            indices.resize(frame_options.most);
            break;
        }
        shown.every *= 2;
        std::erase_if(indices, [&](std::uint32_t i) {
            return static_cast<std::uint64_t>(*id.at<std::int64_t>(i)) % shown.every != 0;
        });
    }
    shown.count = indices.size();
    shown.indices = std::move(indices);
    return shown;
}

std::string frame_message(std::uint32_t request, const SceneFrame& points, const FrameOptions& frame_options,
                          CheckedJson head)
{
    Message message(std::move(head));
    const ShownPoints shown = shown_points(points, frame_options);
    const Indices* const indices = shown.all_or_some();
    message.header()["total"] = points.size();
    message.header()["shown"] = shown.count;
    message.header()["every"] = shown.every;
    add_positions(message, points, indices);
    add_colours(message, points, frame_options, indices);
    if (const auto pscale = find_column(points, "pscale", ColumnType::Float)) {
        if (pscale->stride == 0)
            message.header()["radius"] = points.size() == 0 ? 0.0f : *pscale->at<float>(0);
        else
            add_values(message, "radius", numbers_of(points, "pscale", indices));
    }
    if (frame_options.velocities) add_velocities(message, points, indices);
    return message.finish(request);
}

std::string trails_message(std::uint32_t request, const std::vector<float>& ends, std::uint64_t every)
{
    Message message(CheckedJson({{"every", every}}));
    message.add<float>("ends", "f32", ends.size(),
                       [&](std::span<float> to) { std::copy(ends.begin(), ends.end(), to.begin()); });
    return message.finish(request);
}

std::string shapes_message(std::uint32_t request, const SceneShapes& shapes, const std::set<std::uint64_t>& known,
                           const std::vector<std::uint64_t>& numbers, CheckedJson head)
{
    Message message(std::move(head));
    CheckedJson bodies = CheckedJson::array(), planes = CheckedJson::array();
    for (const ShapePlane& plane : shapes.planes())
        planes.push_back({{"normal", plane.normal}, {"offset", plane.offset}});
    const std::vector<ShapeMesh> meshes = shapes.meshes();
    for (std::size_t b = 0; b < meshes.size(); ++b) {
        const ShapeMesh& mesh = meshes[b];
        bodies.push_back({{"mesh", numbers[b]}, {"role", mesh.role == ShapeRole::Collider ? "collider" : "emitter"}});
        if (known.contains(numbers[b])) continue;
        const std::string name = std::to_string(numbers[b]);
        message.add<float>("P" + name, "f32", 3 * mesh.corner_count,
                           [&mesh](std::span<float> to) { std::copy_n(mesh.positions, to.size(), to.begin()); });
        message.add<std::uint32_t>("T" + name, "u32", 3 * mesh.triangle_count, [&mesh](std::span<std::uint32_t> to) {
            std::copy_n(mesh.triangles, to.size(), to.begin());
        });
    }
    message.header()["bodies"] = std::move(bodies);
    message.header()["planes"] = std::move(planes);
    return message.finish(request);
}

}  // namespace rapid
