#include "bindings/view/simulation.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <utility>

#include "bindings/view/run.h"
#include "runtime/graph/evaluate.h"
#include "runtime/io/format.h"
#include "runtime/points/spare_pages.h"
#include "runtime/report/biography.h"
#include "runtime/report/graphviz.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_ending = 2;
constexpr std::size_t most_spare = 32;  // columns of frames that have been replaced, whose pages serve the next

fs::file_time_type changed_at(const fs::path& file)
{
    std::error_code none;
    const auto time = fs::last_write_time(file, none);
    return none ? fs::file_time_type::min() : time;  // one that may come
}

}  // namespace

Error error_of(const std::exception& error)
{
    if (const auto* known = dynamic_cast<const Error*>(&error)) return *known;
    return Error(dynamic_cast<const std::bad_alloc*>(&error) ? "out of memory" : error.what());
}

ViewSimulation::ViewSimulation(ViewOptions options, std::function<void()> changed)
    : options_(std::move(options)), changed_(std::move(changed)), store_(options_.memory)
{
    status_.version = 1;
    SparePages::all().keep(most_spare);
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

std::string ViewSimulation::laid_out(const std::string& dot)
{
    {
        const std::lock_guard lock(mutex_);
        if (layout_.dot == dot) return layout_.json;
    }
    std::string json = lay_out(dot, "json");
    const std::lock_guard lock(mutex_);
    layout_ = {dot, json};
    return json;
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
