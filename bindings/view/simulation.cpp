#include "bindings/view/simulation.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <utility>

#include "bindings/scene/scene_inside.h"
#include "bindings/view/frame_message.h"
#include "bindings/view/run.h"
#include "runtime/base/json.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr char not_traced[] = "points of a sequence of files can't be traced; open the scene instead";

constexpr std::size_t max_ending = 2;
constexpr std::size_t max_spare = 32;  // columns of replaced frames, whose pages the next ones reuse

fs::file_time_type changed_at(const fs::path& file)
{
    std::error_code none;
    const auto time = fs::last_write_time(file, none);
    return none ? fs::file_time_type::min() : time;  // the file may appear later
}

int bytes_of_value(const SceneColumn& column)
{
    switch (column.type) {
        case ColumnType::Float:
        case ColumnType::Int32:
        case ColumnType::String:
        case ColumnType::Vec3:
        case ColumnType::Quat:
            return static_cast<int>(4 * column.components);
        case ColumnType::Int64:
            return 8;
        case ColumnType::UInt8:
            return 1;
    }
    return 0;
}

}  // namespace

Error error_of(const std::exception& error)
{
    if (const auto* known = dynamic_cast<const Error*>(&error)) return *known;
    if (const auto* of_scene = dynamic_cast<const SceneException*>(&error)) {
        const SceneError& known = of_scene->error();
        return Error(known.message).in_node(known.node).at({known.file, known.line});
    }
    return Error(dynamic_cast<const std::bad_alloc*>(&error) ? "out of memory" : error.what());
}

ViewSimulation::ViewSimulation(ViewOptions options, std::function<void()> changed)
    : options_(std::move(options)), changed_(std::move(changed)), store_(options_.memory)
{
    status_.version = 1;
    SceneInside::keep_spare_columns(max_spare).value();
    if (!options_.cache.empty()) cache_ = std::make_unique<FrameCache>(options_.cache);
    if (!is_sequence()) {
        begin();
        return;
    }
    status_.state = ViewState::Done;
    status_.first = options_.files.begin()->first;
    status_.last = options_.files.rbegin()->first;
    status_.outputs = {"main"};
}

ViewSimulation::~ViewSimulation()
{
    tracer_stop_.request_stop();
    if (tracer_.joinable()) tracer_.join();
    if (run_) run_->abandon();
    run_.reset();
    ending_.clear();
}

void ViewSimulation::begin()
{
    std::uint64_t number = 0;
    {
        const std::lock_guard lock(mutex_);
        number = ++status_.run;
        ++status_.version;
        status_.state = ViewState::Starting;
        read_.clear();
    }
    if (run_) {
        run_->abandon();
        ending_.push_back(std::move(run_));
    }
    collect_ended();
    run_ = std::make_unique<Run>(*this, number);
    changed_();
}

// Removes runs that have ended. If too many are left, waits for the first.
void ViewSimulation::collect_ended()
{
    std::erase_if(ending_, [](const auto& run) { return run->ended(); });
    while (ending_.size() > max_ending) ending_.pop_front();
}

std::size_t ViewSimulation::ending() const
{
    return static_cast<std::size_t>(
        std::count_if(ending_.begin(), ending_.end(), [](const auto& run) { return !run->ended(); }));
}

void ViewSimulation::set(std::map<std::string, std::string> values)
{
    if (is_sequence()) return;
    {
        const std::lock_guard lock(mutex_);
        values_ = std::move(values);
    }
    begin();
}

std::map<std::string, std::string> ViewSimulation::values() const
{
    const std::lock_guard lock(mutex_);
    return values_;
}

bool ViewSimulation::check_files()
{
    collect_ended();
    {
        const std::lock_guard lock(mutex_);
        const bool changed = std::any_of(read_.begin(), read_.end(),
                                         [](const auto& entry) { return changed_at(entry.first) != entry.second; });
        if (!changed) return false;
    }
    begin();
    return true;
}

void ViewSimulation::note_file(std::uint64_t run, const fs::path& file)
{
    const std::lock_guard lock(mutex_);
    if (status_.run == run) read_.try_emplace(fs::absolute(file), changed_at(file));
}

SceneOptions ViewSimulation::scene_options() const
{
    SceneOptions options = options_.scene;
    for (const auto& [name, value] : values()) options.set.emplace_back(name, value);  // the later of two wins
    return options;
}

GraphLayout ViewSimulation::layout() const
{
    const std::lock_guard lock(mutex_);
    return layout_;
}

void ViewSimulation::keep(GraphLayout layout)
{
    const std::lock_guard lock(mutex_);
    layout_ = std::move(layout);
}

ViewStatus ViewSimulation::status() const
{
    const std::lock_guard lock(mutex_);
    return status_;
}

ViewFramePtr ViewSimulation::frame(std::int64_t number)
{
    if (ViewFramePtr known = store_.find(number)) return known;
    return is_sequence() ? read_file(number) : nullptr;
}

ViewFramePtr ViewSimulation::read_file(std::int64_t number)
{
    const auto file = options_.files.find(static_cast<int>(number));
    if (file == options_.files.end()) return nullptr;
    const SceneFrame points = SceneFrame::read(file->second).value();
    auto frame = std::make_shared<ViewFrame>(ViewFrame{number, ++file_uses_, points, ""});  // older ones make room
    JsonText statistics;
    statistics.object("frame", number, "points", points.size());
    frame->statistics = statistics.text();
    frame->bytes = bytes_of(*frame);
    store_.put(frame);
    {
        const std::lock_guard lock(mutex_);
        for (const std::string& name : points.columns()) status_.names[name] = bytes_of_value(*points.column(name));
        for (const std::string& name : points.groups()) status_.names[group_mark + name] = 1;
        ++status_.version;
    }
    changed_();
    return frame;
}

template <class T>
void ViewSimulation::query_run(std::function<T(Run&)> answer, std::function<void(T, std::string error)> callback)
{
    run_->enqueue([answer = std::move(answer), callback = std::move(callback)](Run& run) {
        if (!run.has_scene()) return callback({}, "the scene has an error");
        try {
            callback(answer(run), "");
        } catch (const std::exception& error) {
            callback({}, error_of(error).what());
        }
    });
}

void ViewSimulation::inspect(std::int64_t frame, std::function<void(Results, std::string error)> callback)
{
    if (!run_) return callback({}, "a sequence of files has no nodes");
    query_run<Results>([=](Run& run) { return run.inspect(frame); }, std::move(callback));
}

void ViewSimulation::arguments(std::int64_t frame, std::function<void(Arguments, std::string error)> callback)
{
    if (!run_) return callback({}, "a sequence of files has no nodes");
    query_run<Arguments>([=](Run& run) { return run.arguments(frame); }, std::move(callback));
}

void ViewSimulation::origin(std::int64_t frame, std::string output, std::int64_t id,
                            std::function<void(PointOrigin, std::string error)> callback)
{
    if (!run_) return callback({}, not_traced);
    query_run<PointOrigin>([=](Run& run) { return run.origin(frame, output, id); }, std::move(callback));
}

void ViewSimulation::trace(const PointOrigin& point, std::int64_t last,
                           std::function<void(std::string json, std::string error)> callback)
{
    if (is_sequence()) return callback("", not_traced);
    tracer_stop_.request_stop();
    if (tracer_.joinable()) tracer_.join();
    tracer_stop_ = std::stop_source();
    tracer_ = std::thread([=, this, options = scene_options(), stop = tracer_stop_.get_token(),
                           callback = std::move(callback)] {
        tbb::task_arena arena(options_.threads);
        arena.execute([&] {
            try {
                SceneHooks hooks;
                hooks.stop = stop;
                Scene scene = SceneInside::open(options_.graph, options, hooks).value();
                const SceneTrace trace = scene.trace({{point.id}, point.create, scene.first_frame(), last, 1}).value();
                if (trace.fault) throw SceneException(*trace.fault);
                callback(trace.lives.json, "");
            } catch (const std::exception& error) {
                callback("", stop.stop_requested() ? "another point was requested" : error_of(error).what());
            }
        });
    });
}

}  // namespace rapid
