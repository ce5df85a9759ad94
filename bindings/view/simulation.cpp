#include "bindings/view/simulation.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "bindings/command/graphviz.h"
#include "bindings/host/picture_scene.h"
#include "runtime/graph/evaluate.h"
#include "runtime/io/format.h"
#include "runtime/points/id_index.h"
#include "runtime/report/biography.h"
#include "runtime/report/graph_picture.h"
#include "runtime/report/statistics.h"
#include "runtime/stopwatch.h"

namespace rapid {
namespace {
namespace fs = std::filesystem;
constexpr std::size_t most_warnings = 200;
constexpr std::size_t most_ending = 2;
constexpr std::size_t most_laid_out = 150;  // nodes, by Graphviz
constexpr double snapshot_seconds = 0.25;   // of computing: so much is computed again to inspect a frame
constexpr double cached_seconds = 5;        // likewise, to go on from the cache
Error error_of(const std::exception& error)
{
    if (const auto* known = dynamic_cast<const Error*>(&error)) return *known;
    return Error(dynamic_cast<const std::bad_alloc*>(&error) ? "out of memory" : error.what());
}

fs::file_time_type changed_at(const fs::path& file)
{
    std::error_code none;
    const auto time = fs::last_write_time(file, none);
    return none ? fs::file_time_type::min() : time;  // one that may come
}

// The newest snapshot of a run at or before a frame.
const Snapshot* latest(const std::map<std::int64_t, Snapshot>& snapshots, std::int64_t frame)
{
    const auto after = snapshots.upper_bound(frame);
    return after == snapshots.begin() ? nullptr : &std::prev(after)->second;
}

}  // namespace

// One run of the scene. Its functions but abandon() and ask() are the thread's own.
class ViewSimulation::Run {
public:
    Run(ViewSimulation& view, std::uint64_t number) : view_(view), number_(number)
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
    ~Run()
    {
        abandon();
        thread_.join();
    }

    void abandon()
    {
        stop_.request();
        const std::lock_guard lock(mutex_);
        wake_.notify_all();
    }
    bool ended() const { return ended_; }

    using Task = std::function<void(Run&)>;
    void ask(Task task)
    {
        const std::lock_guard lock(mutex_);
        tasks_.push_back(std::move(task));
        wake_.notify_all();
    }

    // Null: there is no plan, for an error.
    const Plan* plan() const { return plan_.get(); }

    std::shared_ptr<const Results> inspect(std::int64_t frame)
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

    Arguments arguments(std::int64_t frame) const
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

    Origin origin(std::int64_t frame, const std::string& output, std::int64_t id)
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

private:
    PlanOptions plan_options() const
    {
        PlanOptions options;
        options.seed = view_.options_.seed;
        return options;
    }

    bool stopped() const { return stop_.cancellation.is_requested(); }

    // Calls `change` with the status, unless this run has been abandoned.
    template <class F>
    void tell(const F& change)
    {
        {
            const std::lock_guard lock(view_.mutex_);
            if (view_.status_.run != number_) return;
            change(view_.status_);
            ++view_.status_.version;
        }
        view_.changed_();
    }

    void run()
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

    void begin()
    {
        SessionOptions options = view_.options_.session;
        for (const auto& [name, value] : view_.values()) options.set[name] = value;
        options.on_read = [this](const fs::path& file) { note_file(file); };
        options.keeps_state = view_.cache_ != nullptr;
        if (view_.cache_)
            contents_ = std::make_unique<InputContents>(fs::path(view_.options_.graph).parent_path(),
                                                        InputContents::Code::LeftOut);
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
            cached_ = view_.cache_->open(fingerprint_of(*session_, *plan_, view_.options_.graph, contents_->take()),
                                         *contents_);
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

    // The frames that the cache has.
    void take_known(ViewStatus& status)
    {
        if (!cached_) return;
        for (const auto& [number, known] : cached_->known()) {
            if (number < first_ || number > last_) continue;
            view_.store_.add(number, number_, known.statistics, cached_);
            for (const std::string& text : known.warnings) warn(status, number, text);
        }
    }

    bool is_known(std::int64_t frame) const { return cached_ && cached_->known().contains(frame); }
    std::optional<Snapshot> cached_snapshot_before(std::int64_t frame) const
    {
        return cached_ && !cached_->known().empty() ? cached_->snapshot_before(frame) : std::nullopt;
    }

    static void warn(ViewStatus& status, std::int64_t frame, const std::string& text)
    {
        const auto same = std::find_if(status.warnings.begin(), status.warnings.end(),
                                       [&](const auto& known) { return known.second == text; });
        if (same != status.warnings.end()) return;
        if (status.warnings.size() < most_warnings)
            status.warnings.emplace_back(frame, text);
        else
            ++status.more_warnings;
    }

    void compute()
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
        tell([](ViewStatus& status) { status.state = ViewState::Done; });
    }

    // is_whole: it has its shapes, and may go to the cache.
    bool publish(const ViewFramePtr& frame, const std::vector<std::string>& warnings, bool is_whole)
    {
        if (stopped()) return false;
        if (cached_ && is_whole) cached_->put(*frame, warnings, contents_->take());
        bool kept = view_.store_.put(frame, is_whole ? cached_ : nullptr);
        if (!kept && cached_ && is_whole) {
            view_.store_.add(frame->number, number_, frame->statistics, cached_);
            kept = true;
        }
        tell([&](ViewStatus& status) {
            if (cached_)
                for (const std::string& text : cached_->take_failures()) warn(status, frame->number, text);
            for (const std::string& text : session_->take_warnings()) warn(status, frame->number, text);
            for (const std::string& text : warnings) warn(status, frame->number, text);
            if (!kept) status.state = ViewState::Full;
        });
        return kept;
    }

    // They share columns with each other and the frames, but not all of them: of many every second is dropped.
    void keep_snapshot(Snapshot snapshot)
    {
        constexpr std::size_t most = 32;
        snapshots_[snapshot.frame] = std::move(snapshot);
        if (snapshots_.size() <= most) return;
        bool odd = false;
        std::erase_if(snapshots_, [&](const auto&) { return odd = !odd; });
    }

    void draw_graph()
    {
        const GraphPicture picture = picture_of(*plan_);
        std::string laid_out, why_not;
        // The page lays out the others: dot would take seconds, and the sandbox starts no program.
        if (picture.nodes.size() <= most_laid_out && !view_.options_.is_confined) try {
                laid_out = lay_out(to_dot(picture), "json");
            } catch (const Error& error) {
                why_not = error.what();
            }
        const auto json = std::make_shared<const std::string>(to_json(picture, laid_out));
        tell([&](ViewStatus& status) {
            status.graph = json;
            ++status.graph_number;
            status.no_graph = why_not;
        });
    }

    void note_file(const fs::path& file)
    {
        if (contents_) contents_->add(file);
        const std::lock_guard lock(view_.mutex_);
        if (view_.status_.run == number_) view_.read_.try_emplace(fs::absolute(file), changed_at(file));
    }

    // Empty: there is none, or the run is to end.
    Task next_task(bool wait)
    {
        std::unique_lock lock(mutex_);
        if (wait) wake_.wait(lock, [&] { return stopped() || !tasks_.empty(); });
        if (stopped() || tasks_.empty()) return {};
        Task task = std::move(tasks_.front());
        tasks_.pop_front();
        return task;
    }

    ViewSimulation& view_;
    const std::uint64_t number_;
    std::unique_ptr<Session> session_;
    std::unique_ptr<Plan> plan_;
    std::unique_ptr<InputContents> contents_;  // of the files that it reads; null without a cache
    std::shared_ptr<CachedRun> cached_;        // null without a cache
    std::int64_t first_ = 1, last_ = 1;
    std::map<std::int64_t, Snapshot> snapshots_;
    std::shared_ptr<const Results> inspected_;
    std::int64_t inspected_frame_ = 0;

    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<Task> tasks_;
    Stop stop_;
    std::atomic<bool> ended_{false};
    std::thread thread_;  // the last member: it starts when the others are initialised
};

ViewSimulation::ViewSimulation(ViewOptions options, std::function<void()> changed)
    : options_(std::move(options)), changed_(std::move(changed)), store_(options_.memory)
{
    status_.version = 1;
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
    if (tracer_stop_) tracer_stop_->request();
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

void ViewSimulation::Stop::request()
{
    cancellation.request();
    scripts->request(Cancellation::text, Interruption::Asked);
}

// Those that are at their end; of too many, waits for the first.
void ViewSimulation::collect_ended()
{
    std::erase_if(ending_, [](const auto& run) { return run->ended(); });
    while (ending_.size() > most_ending) ending_.pop_front();
    const std::lock_guard lock(mutex_);
    status_.ending = ending_.size();
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
    auto frame = std::make_shared<ViewFrame>();
    frame->number = number;
    frame->run = ++file_uses_;  // older ones make room
    frame->outputs["main"] = read_points(file->second);
    frame->statistics = fmt::format("{{\"frame\": {}, \"points\": {}}}", number, frame->outputs["main"].size());
    frame->bytes = bytes_of(*frame);
    store_.put(frame);
    {
        const std::lock_guard lock(mutex_);
        for (const auto& [name, column] : frame->outputs["main"].columns())
            status_.names[name] = static_cast<int>(std::visit([](const auto& c) { return sizeof(c[0]); }, column));
        for (const auto& [name, members] : frame->outputs["main"].groups()) status_.names[group_prefix + name] = 1;
        ++status_.version;
    }
    changed_();
    return frame;
}

void ViewSimulation::inspect(std::int64_t frame,
                             std::function<void(std::shared_ptr<const Results>, std::string error)> told)
{
    if (!run_) return told(nullptr, "a sequence of files has no nodes");
    run_->ask([frame, told = std::move(told)](Run& run) {
        if (!run.plan()) return told(nullptr, "the scene has an error");
        try {
            told(run.inspect(frame), "");
        } catch (const std::exception& error) {
            told(nullptr, error_of(error).what());
        }
    });
}

void ViewSimulation::arguments(std::int64_t frame, std::function<void(Arguments, std::string error)> told)
{
    if (!run_) return told({}, "a sequence of files has no nodes");
    run_->ask([frame, told = std::move(told)](Run& run) {
        if (!run.plan()) return told({}, "the scene has an error");
        try {
            told(run.arguments(frame), "");
        } catch (const std::exception& error) {
            told({}, error_of(error).what());
        }
    });
}

void ViewSimulation::origin(std::int64_t frame, std::string output, std::int64_t id,
                            std::function<void(Origin, std::string error)> told)
{
    if (!run_) return told({}, "a sequence of files has no biographies");
    run_->ask([=, output = std::move(output), told = std::move(told)](Run& run) {
        if (!run.plan()) return told({}, "the scene has an error");
        try {
            told(run.origin(frame, output, id), "");
        } catch (const std::exception& error) {
            told({}, error_of(error).what());
        }
    });
}

void ViewSimulation::trace(const Origin& point, std::int64_t last,
                           std::function<void(std::string json, std::string error)> told)
{
    if (is_sequence()) return told("", "a sequence of files has no biographies");
    if (tracer_stop_) tracer_stop_->request();
    if (tracer_.joinable()) tracer_.join();
    tracer_stop_ = std::make_shared<Stop>();
    SessionOptions session = options_.session;
    for (const auto& [name, value] : values()) session.set[name] = value;
    session.interruptible = true;
    session.interruption = tracer_stop_->scripts;
    tracer_ = std::thread([=, this, stop = tracer_stop_, told = std::move(told)] {
        tbb::task_arena arena(options_.threads);
        arena.execute([&] {
            const Cancellation::Scope scope(&stop->cancellation);
            try {
                const Session scene(options_.graph, session);
                PlanOptions options;
                options.seed = options_.seed;
                options.keep_steps = true;
                const Plan plan(scene.graph(), options);
                Biographer biographer(plan, {point.id}, point.create);
                Evaluator evaluator(plan, {}, biographer.results());
                evaluator.leave_out_errors();
                biographer.watch(evaluator);
                while (evaluator.next_frame() <= last) biographer.add(evaluator.advance());
                told(to_json(biographer.lives()), "");
            } catch (const std::exception& error) {
                const bool is_stopped = stop->cancellation.is_requested();
                told("", is_stopped ? "another point was asked for" : error_of(error).what());
            }
        });
    });
}

}  // namespace rapid
