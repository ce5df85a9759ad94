#include "bindings/view/run.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <utility>

#include "bindings/scene/scene_inside.h"
#include "runtime/base/stopwatch.h"

namespace rapid {
namespace {

constexpr std::size_t max_warnings = 200;
constexpr std::size_t max_laid_out = 150;  // nodes; the limit for Graphviz
constexpr double snapshot_seconds = 0.25;  // of computing, at most repeated to inspect a frame
constexpr double cached_seconds = 5;       // likewise, to continue from the cache

}  // namespace

ViewSimulation::Run::Run(ViewSimulation& view, std::uint64_t number) : view_(view), number_(number)
{
    thread_ = std::thread([this] {
        tbb::task_arena arena(view_.options_.threads);
        arena.execute([this] { run(); });
        ended_ = true;
    });
}

ViewSimulation::Run::~Run()
{
    abandon();
    thread_.join();
}

void ViewSimulation::Run::abandon()
{
    stop_.request_stop();
    const std::lock_guard lock(mutex_);
    wake_.notify_all();
}

void ViewSimulation::Run::enqueue(Task task)
{
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
    wake_.notify_all();
}

ViewSimulation::Results ViewSimulation::Run::inspect(std::int64_t frame)
{
    Results results =
        SceneInside::points_after_nodes(*scene_, frame, inspected_ == frame ? std::nullopt : snapshot_before(frame))
            .value();
    inspected_ = frame;
    return results;
}

ViewSimulation::Arguments ViewSimulation::Run::arguments(std::int64_t frame)
{
    return SceneInside::arguments(*scene_, frame).value();
}

PointOrigin ViewSimulation::Run::origin(std::int64_t frame, const std::string& output, std::int64_t id)
{
    const auto& outputs = SceneInside::outputs(*scene_);
    const auto of = std::find_if(outputs.begin(), outputs.end(), [&](const auto& one) { return one.name == output; });
    if (of == outputs.end()) throw Error("the scene has no output of this name");
    if (of->creates.size() == 1) return {of->creates.front(), id};
    const ViewFramePtr shown = view_.store_.find(frame);
    if (!shown || shown->run != number_) throw Error("the frame is not computed");
    inspect(frame);
    return SceneInside::origin(*scene_, shown->points.output(output).value(), id).value();
}

template <class F>
void ViewSimulation::Run::update_status(const F& change)
{
    {
        const std::lock_guard lock(view_.mutex_);
        if (view_.status_.run != number_) return;
        change(view_.status_);
        ++view_.status_.version;
    }
    view_.changed_();
}

void ViewSimulation::Run::run()
{
    try {
        begin();
        compute();
    } catch (const std::exception& error) {
        const Error known = error_of(error);
        if (!stopped())
            update_status([&](ViewStatus& status) {
                status.state = ViewState::Failed;
                status.error = known;
            });
    }
    // A scene that has failed still answers questions about the frames that it has.
    while (const Task task = next_task(true)) task(*this);
    // The remaining tasks end at once with an error.
    for (const Task& task : std::exchange(tasks_, {})) task(*this);
}

void ViewSimulation::Run::begin()
{
    SceneHooks hooks;
    hooks.stop = stop_.get_token();
    hooks.on_file_read = [this](const std::string& file) { view_.note_file(number_, file); };
    hooks.parameters = [this](const std::vector<SceneParameter>& parameters) {
        update_status([&](ViewStatus& status) { status.parameters = parameters; });
    };
    hooks.keep_state = view_.cache_ != nullptr;
    hooks.per_point_diagnostics = true;
    hooks.watch_memory = false;  // frames share the memory, and are evicted
    view_.note_file(number_, view_.options_.graph);
    scene_ = SceneInside::open(view_.options_.graph, view_.scene_options(), std::move(hooks)).value();
    const std::int64_t start = scene_->first_frame();
    const auto [first, last] = view_.options_.frames.value_or(std::pair(start, start + 239));
    if (last < start) throw Error(fmt::format("-f: frame {} is before the scene's first, {}", last, start));
    first_ = start;
    last_ = last;
    if (view_.cache_) cached_ = view_.cache_->open(*scene_);
    const std::vector<SceneAttribute> attributes = SceneInside::attributes(*scene_).value();
    update_status([&, last_frame = last](ViewStatus& status) {
        status.state = ViewState::Computing;
        status.first = start;
        status.last = last_frame;
        status.fps = scene_->fps();
        status.error.reset();
        status.warnings.clear();
        status.more_warnings = 0;
        status.outputs.clear();
        for (const SceneOutput& output : SceneInside::outputs(*scene_)) status.outputs.push_back(output.name);
        status.names.clear();
        for (const SceneAttribute& attribute : attributes) {
            int& bytes = status.names.try_emplace(attribute.name, -1).first->second;
            if (attribute.is_kept) bytes = std::max(bytes, static_cast<int>(attribute.bytes));
        }
        for (const std::string& text : scene_->warnings()) warn(status, 0, text);
        take_known(status);
    });
}

void ViewSimulation::Run::take_known(ViewStatus& status)
{
    if (!cached_) return;
    for (const auto& [number, known] : cached_->known()) {
        if (number < first_ || number > last_) continue;
        view_.store_.add(number, number_, known.statistics, cached_);
        for (const std::string& text : known.warnings) warn(status, number, text);
    }
}

std::optional<SceneSnapshot> ViewSimulation::Run::cached_snapshot_before(std::int64_t frame) const
{
    return cached_ && !cached_->known().empty() ? cached_->snapshot_before(frame) : std::nullopt;
}

std::optional<SceneSnapshot> ViewSimulation::Run::snapshot_before(std::int64_t frame) const
{
    const auto after = snapshots_.lower_bound(frame);
    return after == snapshots_.begin() ? cached_snapshot_before(frame) : std::prev(after)->second;
}

void ViewSimulation::Run::warn(ViewStatus& status, std::int64_t frame, const std::string& text)
{
    const auto same = std::find_if(status.warnings.begin(), status.warnings.end(),
                                   [&](const auto& known) { return known.second == text; });
    if (same != status.warnings.end()) return;
    if (status.warnings.size() < max_warnings)
        status.warnings.emplace_back(frame, text);
    else
        ++status.more_warnings;
}

void ViewSimulation::Run::warn_of_cache(ViewStatus& status, std::int64_t frame)
{
    if (!cached_) return;
    for (const std::string& text : cached_->take_failures()) warn(status, frame, text);
}

void ViewSimulation::Run::compute()
{
    Stopwatch since_snapshot, since_cached;
    std::int64_t due = first_;
    while (due <= last_ && is_known(due)) ++due;
    if (due > first_) {
        draw_graph();
        if (const auto snapshot = cached_snapshot_before(due)) scene_->restore(*snapshot).value();
    }
    while (!stopped() && due <= last_ && scene_->next_frame() <= last_) {
        while (const Task task = next_task(false)) task(*this);
        if (stopped()) return;
        const std::int64_t number = scene_->next_frame();
        const SceneFrame result = scene_->advance().value();
        if (is_known(number)) continue;  // this frame only leads from a snapshot to the requested one
        std::vector<std::string> warnings = result.warnings();
        const auto add_shapes = [&](ViewFrame& frame) {
            frame.shapes = scene_->shapes(number).value();
            for (std::string& text : frame.shapes.warnings()) warnings.push_back(std::move(text));
            frame.bytes = bytes_of(frame);
        };
        auto frame = std::make_shared<ViewFrame>(
            ViewFrame{number, number_, SceneInside::without_statistics(result).value(), result.statistics_json()});
        frame->bytes = bytes_of(*frame);
        // Shapes of the first frame follow its points: they may take long.
        if (number > first_) add_shapes(*frame);
        if (since_snapshot.seconds() > snapshot_seconds) {
            keep_snapshot(scene_->save().value());
            since_snapshot = Stopwatch();
        }
        if (cached_ && (since_cached.seconds() > cached_seconds || number == last_)) {
            cached_->keep(scene_->save().value());
            since_cached = Stopwatch();
        }
        if (!publish(frame, warnings, 0, number > first_)) return;
        if (number == first_) {
            auto with_shapes = std::make_shared<ViewFrame>(*frame);
            const std::size_t count_before = warnings.size();
            add_shapes(*with_shapes);
            if (!publish(with_shapes, warnings, count_before, true)) return;
            draw_graph();
        }
    }
    if (stopped()) return;
    view_.store_.keep_only(number_);
    if (cached_) cached_->finish();
    update_status([this](ViewStatus& status) {
        warn_of_cache(status, last_);
        status.state = ViewState::Done;
    });
}

bool ViewSimulation::Run::publish(const ViewFramePtr& frame, const std::vector<std::string>& warnings,
                                  std::size_t count_before, bool is_whole)
{
    if (stopped()) return false;
    if (cached_ && is_whole) cached_->put(*frame, warnings, SceneInside::take_inputs(*scene_).value());
    bool kept = view_.store_.put(frame, is_whole ? cached_ : nullptr);
    if (!kept && cached_ && is_whole) {
        view_.store_.add(frame->number, number_, frame->statistics, cached_);
        kept = true;
    }
    update_status([&](ViewStatus& status) {
        warn_of_cache(status, frame->number);
        for (std::size_t k = count_before; k < warnings.size(); ++k) warn(status, frame->number, warnings[k]);
        if (!kept) status.state = ViewState::Full;
    });
    return kept;
}

void ViewSimulation::Run::keep_snapshot(const SceneSnapshot& snapshot)
{
    constexpr std::size_t most = 32;
    snapshots_.insert_or_assign(snapshot.frame(), snapshot);
    if (snapshots_.size() <= most) return;
    bool odd = false;
    std::erase_if(snapshots_, [&](const auto&) { return odd = !odd; });
}

void ViewSimulation::Run::draw_graph()
{
    std::string drawn, why_not;
    // The page lays out larger graphs: dot would take seconds, and the sandbox starts no program.
    if (scene_->nodes().size() <= max_laid_out && !view_.options_.is_confined) {
        GraphLayout layout = view_.layout();
        Result<std::string> graph = SceneInside::graph_json(*scene_, &layout);
        if (graph)
            drawn = std::move(*graph);
        else
            why_not = graph.error().text();
        view_.keep(std::move(layout));
    }
    if (drawn.empty()) drawn = SceneInside::graph_json(*scene_, nullptr).value();
    const auto json = std::make_shared<const std::string>(std::move(drawn));
    update_status([&](ViewStatus& status) {
        status.no_graph = why_not;
        if (status.graph && *status.graph == *json) return;
        status.graph = json;
        ++status.graph_number;
    });
}

ViewSimulation::Run::Task ViewSimulation::Run::next_task(bool wait)
{
    std::unique_lock lock(mutex_);
    if (wait) wake_.wait(lock, [&] { return stopped() || !tasks_.empty(); });
    if (stopped() || tasks_.empty()) return {};
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    return task;
}

}  // namespace rapid
