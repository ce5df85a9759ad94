#include "bindings/view/run.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <utility>

#include "bindings/host/picture_scene.h"
#include "runtime/graph/evaluate.h"
#include "runtime/points/id_index.h"
#include "runtime/report/graph_picture.h"
#include "runtime/report/statistics.h"
#include "runtime/stopwatch.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_warnings = 200;
constexpr std::size_t most_laid_out = 150;  // nodes, by Graphviz
constexpr double snapshot_seconds = 0.25;   // of computing: so much is computed again to inspect a frame
constexpr double cached_seconds = 5;        // likewise, to go on from the cache

// The newest snapshot of a run at or before a frame.
const Snapshot* latest(const std::map<std::int64_t, Snapshot>& snapshots, std::int64_t frame)
{
    const auto after = snapshots.upper_bound(frame);
    return after == snapshots.begin() ? nullptr : &std::prev(after)->second;
}

}  // namespace

ViewSimulation::Run::Run(ViewSimulation& view, std::uint64_t number) : view_(view), number_(number)
{
    thread_ = std::thread([this] {
        tbb::task_arena arena(view_.options_.threads);
        arena.execute([this] {
            const Cancellation::Scope scope(&stop_.cancellation);
            run();
        });
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
    stop_.request();
    const std::lock_guard lock(mutex_);
    wake_.notify_all();
}

void ViewSimulation::Run::ask(Task task)
{
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
    wake_.notify_all();
}

std::shared_ptr<const ViewSimulation::Results> ViewSimulation::Run::inspect(std::int64_t frame)
{
    if (inspected_ && inspected_frame_ == frame) return inspected_;
    const Plan plan(session_->graph(), plan_options());
    auto results = std::make_shared<Results>();
    Evaluator evaluator(plan, {}, [&](const Node& node, std::int64_t at, const PointSet& points) {
        if (at == frame) (*results)[node.name] = points;
    });
    evaluator.tell_points();
    if (const Snapshot* snapshot = latest(snapshots_, frame - 1))
        evaluator.load(*snapshot);
    else if (const auto kept = cached_snapshot_before(frame))
        evaluator.load(*kept);
    while (evaluator.next_frame() <= frame && !stopped()) evaluator.advance();
    inspected_ = results;
    inspected_frame_ = frame;
    return results;
}

ViewSimulation::Arguments ViewSimulation::Run::arguments(std::int64_t frame) const
{
    Arguments all;
    for (const PlannedNode& planned : plan_->nodes) {
        const PlannedSimulation& simulation = plan_->simulations[planned.simulation];
        const Frame now =
            FrameClock{simulation.fps, simulation.start, simulation.subframes}.at(static_cast<double>(frame));
        for (const auto& [name, value] : planned.node->arguments) {
            const FrameFunction* function = value.function();
            all[planned.node->name][name] = describe(function ? function->call(now) : value);
        }
    }
    return all;
}

ViewSimulation::Origin ViewSimulation::Run::origin(std::int64_t frame, const std::string& output, std::int64_t id)
{
    const PlannedNode& planned = plan_->nodes.at(plan_->outputs.at(output));
    if (planned.carries.size() <= 1) return {plan_->simulations[planned.simulation].create->name, id};
    const ViewFramePtr shown = view_.store_.find(frame);
    if (!shown || shown->run != number_) throw Error("the frame is not computed");
    const PointSet& points = shown->outputs.at(output);
    const std::uint32_t place = IdIndex(points.id())[id];
    if (place == IdIndex::none) throw Error("the point is not in this frame");
    // The chains' own points that are at the same place, to the bit, with the same velocity.
    std::vector<Origin> found;
    const std::shared_ptr<const Results> results = inspect(frame);
    for (const std::size_t s : planned.carries) {
        const PlannedSimulation& simulation = plan_->simulations[s];
        const auto chain = results->find(simulation.solve ? simulation.solve->name : simulation.create->name);
        if (chain == results->end()) continue;
        const Strided<Vec3f> P = chain->second.P().read(), v = chain->second.v().read();
        for (std::size_t i = 0; i < chain->second.size(); ++i)
            if (P[i] == points.P()[place] && v[i] == points.v()[place])
                found.push_back({simulation.create->name, chain->second.id()[i]});
    }
    if (found.size() == 1) return found.front();
    throw Error(found.empty() ? "the chain of the point is not known: nodes behind its Solve have moved it"
                              : "several points are at this place with this velocity; choose another frame");
}

PlanOptions ViewSimulation::Run::plan_options() const
{
    PlanOptions options;
    options.seed = view_.options_.seed;
    return options;
}

template <class F>
void ViewSimulation::Run::tell(const F& change)
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
            tell([&](ViewStatus& status) {
                status.state = ViewState::Failed;
                status.error = known;
            });
    }
    // A scene that has failed may still be asked about what it has.
    while (const Task task = next_task(true)) task(*this);
    // Those that have not been answered end at once, and say so.
    for (const Task& task : std::exchange(tasks_, {})) task(*this);
}

void ViewSimulation::Run::begin()
{
    SessionOptions options = view_.options_.session;
    for (const auto& [name, value] : view_.values()) options.set[name] = value;
    options.on_read = [this](const fs::path& file) { note_file(file); };
    options.keeps_state = view_.cache_ != nullptr;
    if (view_.cache_)
        contents_ =
            std::make_unique<InputContents>(fs::path(view_.options_.graph).parent_path(), InputContents::Code::LeftOut);
    options.interruptible = true;
    options.interruption = stop_.scripts;
    note_file(view_.options_.graph);
    session_ = std::make_unique<Session>(view_.options_.graph, std::move(options));
    tell([&](ViewStatus& status) { status.parameters = session_->parameters(); });
    plan_ = std::make_unique<Plan>(session_->graph(), plan_options());
    const std::int64_t start = plan_->first_frame();
    const auto [first, last] = view_.options_.frames.value_or(std::pair(start, start + 239));
    if (last < start) throw Error(fmt::format("-f: frame {} is before the scene's first, {}", last, start));
    first_ = start;
    last_ = last;
    if (view_.cache_)
        cached_ =
            view_.cache_->open(fingerprint_of(*session_, *plan_, view_.options_.graph, contents_->take()), *contents_);
    tell([&, last_frame = last](ViewStatus& status) {
        status.state = ViewState::Computing;
        status.first = start;
        status.last = last_frame;
        status.fps = plan_->simulations.front().fps;
        status.error.reset();
        status.warnings.clear();
        status.more_warnings = 0;
        status.outputs.clear();
        for (const auto& [name, node] : plan_->outputs) status.outputs.push_back(name);
        status.names.clear();
        for (const PlannedSimulation& simulation : plan_->simulations)
            for (const PlannedAttribute& attribute : simulation.attributes) {
                int& bytes = status.names.try_emplace(attribute.name, -1).first->second;
                if (attribute.kept) bytes = std::max(bytes, static_cast<int>(attribute.bytes_per_point()));
            }
        for (const PlannedSimulation& simulation : plan_->simulations)
            if (simulation.solve)
                for (const char* name : {"error", "substeps", "asleep"})  // Evaluator::tell_points
                    status.names[name] = std::max(status.names[name], static_cast<int>(sizeof(float)));
        for (const std::string& text : session_->take_warnings()) warn(status, 0, text);
        for (const std::string& text : plan_->warnings) warn(status, 0, text);
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

std::optional<Snapshot> ViewSimulation::Run::cached_snapshot_before(std::int64_t frame) const
{
    return cached_ && !cached_->known().empty() ? cached_->snapshot_before(frame) : std::nullopt;
}

void ViewSimulation::Run::warn(ViewStatus& status, std::int64_t frame, const std::string& text)
{
    const auto same = std::find_if(status.warnings.begin(), status.warnings.end(),
                                   [&](const auto& known) { return known.second == text; });
    if (same != status.warnings.end()) return;
    if (status.warnings.size() < most_warnings)
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
    Evaluator evaluator(*plan_);
    evaluator.tell_points();
    SceneOfPlan scenes(*plan_);
    Stopwatch since_snapshot, since_cached;
    std::int64_t due = first_;
    while (due <= last_ && is_known(due)) ++due;
    if (due > first_) {
        draw_graph();
        if (const auto snapshot = cached_snapshot_before(due)) evaluator.load(*snapshot);
    }
    while (!stopped() && due <= last_ && evaluator.next_frame() <= last_) {
        while (const Task task = next_task(false)) task(*this);
        if (stopped()) return;
        if (is_known(evaluator.next_frame())) {  // it leads from a snapshot to what is due
            evaluator.advance();
            continue;
        }
        auto frame = std::make_shared<ViewFrame>();
        FrameResult result = evaluator.advance();
        frame->number = result.frame;
        frame->run = number_;
        frame->outputs = std::move(result.outputs);
        result.outputs = frame->outputs;  // columns are shared
        frame->statistics = json_line(statistics_of(result), true);
        // Shapes of the first frame come after its points: they may take long.
        frame->scene = result.frame > first_ ? scenes.at(result.frame) : nullptr;
        frame->bytes = bytes_of(*frame);
        if (since_snapshot.seconds() > snapshot_seconds) {
            keep_snapshot(evaluator.save());
            since_snapshot = Stopwatch();
        }
        if (cached_ && (since_cached.seconds() > cached_seconds || result.frame == last_)) {
            cached_->keep(evaluator.save());
            since_cached = Stopwatch();
        }
        if (!publish(frame, result.warnings, result.frame > first_)) return;
        if (result.frame == first_) {
            auto with_shapes = std::make_shared<ViewFrame>(*frame);
            with_shapes->scene = scenes.at(result.frame);
            if (!publish(with_shapes, {}, true)) return;
            draw_graph();
        }
    }
    if (stopped()) return;
    view_.store_.keep_only(number_);
    if (cached_) cached_->finish();
    tell([this](ViewStatus& status) {
        warn_of_cache(status, last_);
        status.state = ViewState::Done;
    });
}

bool ViewSimulation::Run::publish(const ViewFramePtr& frame, const std::vector<std::string>& warnings, bool is_whole)
{
    if (stopped()) return false;
    if (cached_ && is_whole) cached_->put(*frame, warnings, contents_->take());
    bool kept = view_.store_.put(frame, is_whole ? cached_ : nullptr);
    if (!kept && cached_ && is_whole) {
        view_.store_.add(frame->number, number_, frame->statistics, cached_);
        kept = true;
    }
    tell([&](ViewStatus& status) {
        warn_of_cache(status, frame->number);
        for (const std::string& text : session_->take_warnings()) warn(status, frame->number, text);
        for (const std::string& text : warnings) warn(status, frame->number, text);
        if (!kept) status.state = ViewState::Full;
    });
    return kept;
}

void ViewSimulation::Run::keep_snapshot(Snapshot snapshot)
{
    constexpr std::size_t most = 32;
    snapshots_[snapshot.frame] = std::move(snapshot);
    if (snapshots_.size() <= most) return;
    bool odd = false;
    std::erase_if(snapshots_, [&](const auto&) { return odd = !odd; });
}

void ViewSimulation::Run::draw_graph()
{
    const GraphPicture picture = picture_of(*plan_);
    std::string laid_out, why_not;
    // The page lays out the others: dot would take seconds, and the sandbox starts no program.
    if (picture.nodes.size() <= most_laid_out && !view_.options_.is_confined) try {
            laid_out = view_.laid_out(to_dot(picture, Tips::LeftOut));
        } catch (const Error& error) {
            why_not = error.what();
        }
    const auto json = std::make_shared<const std::string>(to_json(picture, laid_out));
    tell([&](ViewStatus& status) {
        status.no_graph = why_not;
        if (status.graph && *status.graph == *json) return;
        status.graph = json;
        ++status.graph_number;
    });
}

void ViewSimulation::Run::note_file(const fs::path& file)
{
    if (contents_) contents_->add(file);
    view_.note_file(number_, file);
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
