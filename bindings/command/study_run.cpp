#include "bindings/command/study_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "bindings/command/command.h"
#include "bindings/command/memory_limit.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/override.h"
#include "runtime/io/compare.h"
#include "runtime/io/id_order.h"
#include "runtime/stopwatch.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

using nlohmann::json;

json json_of(const Value& value)
{
    if (const bool* boolean = value.get<bool>()) return *boolean;
    if (const std::string* text = value.get<std::string>()) return *text;
    return *value.get<double>();
}

Value value_of(const json& value)
{
    if (value.is_boolean()) return Value(value.get<bool>());
    if (value.is_string()) return Value(value.get<std::string>());
    return Value(value.get<double>());
}

json to_event(const Study& study)
{
    json sweep = json::object(), reference;
    for (const auto& [knob, values] : study.sweep)
        for (const Value& value : values) sweep[knob].push_back(json_of(value));
    if (study.reference)
        for (const auto& [knob, value] : *study.reference) reference[knob] = json_of(value);
    return {{"file", study.file},
            {"name", study.name},
            {"sweep", sweep},
            {"lines", study.lines},
            {"frames", {study.first, study.last}},
            {"error", study.error},
            {"last_frame_only", study.last_frame_only},
            {"reference", reference},
            {"repeat_runs", study.repeat_runs}};
}

// The parent tells it.
std::function<void(const std::string& message)> end_at_limit(const TellParent& tell)
{
    return [tell](const std::string& message) {
        tell({{"failed", message}, {"refused", false}});
        _exit(status_done);
    };
}

// One scene: its graph, and the session that its scripts live in.
struct StudyScene {
    std::unique_ptr<Session> session;
    Graph graph;
};

// Without knobs a study file makes no scene, and a graph is the scene itself.
StudyScene load(const StudySource& source, const Knobs& knobs, const TellParent& tell)
{
    SessionOptions options = source.session;
    if (!source.is_graph) options.knobs = knobs;
    options.on_timeout = end_at_limit(tell);
    StudyScene scene;
    scene.session = std::make_unique<Session>(source.file, std::move(options));
    scene.graph = source.is_graph ? with_arguments(scene.session->graph(), knobs) : scene.session->graph();
    return scene;
}

Plan plan_of(const StudyScene& scene, const StudySource& source, const Study& study)
{
    Plan plan(scene.graph, {source.seed, {}});
    if (study.first < plan.first_frame())
        throw Error(fmt::format("frames: {} is before the scene's first frame, {}", study.first, plan.first_frame()));
    return plan;
}

// The output that is compared: main, or the only one.
std::string compared_output(const Plan& plan)
{
    if (plan.outputs.size() > 1 && !plan.outputs.count("main"))
        throw Error("the scene has several outputs and none is called main; call the one to compare main");
    return plan.outputs.count("main") ? "main" : plan.outputs.begin()->first;
}

bool is_compared(const Study& study, std::int64_t frame)
{
    return study.last_frame_only ? frame == study.last : frame > study.first && frame <= study.last;
}

// The rounding error of a position after n frames, m, as the state is rounded to single precision once a frame: each
// frame adds up to half an ulp of P, and of v times the remaining time, in both directions, so that n such errors grow
// as sqrt(n).
double rounding_of(const PointSet& points, std::int64_t frames, double time)
{
    const auto ulp_of_largest = [&](const Column<Vec3f>& column) {
        float largest = 0;
        for (std::size_t i = 0; i < points.size(); ++i) largest = std::max(largest, column[i].cwiseAbs().maxCoeff());
        return largest > 0 && std::isfinite(largest) ? std::ldexp(1.0, std::ilogb(largest) - 23) : 0;
    };
    return std::sqrt(static_cast<double>(frames)) * (ulp_of_largest(points.P()) + time * ulp_of_largest(points.v())) /
           2;
}

// The error of a run, accumulated frame by frame.
class Measure {
public:
    Measure(const Study& study, const Session& session) : study_(study), session_(session) {}

    // The largest residual of the frame's constraints.
    void add(const FrameFigures& figures, const PointSet& points)
    {
        residual_ = std::max(residual_, figures.constraint_residual_max);
        constrained_ |= figures.constraint_rows > 0;
        row_.compared += points.size();
    }

    void add(const PointSet& points, const PointSet& reference, std::int64_t frames, double time)
    {
        const IdMatch match = match_by_id(points, reference);
        row_.missing += match.only_a.size() + match.only_b.size();
        row_.compared += match.a.size();
        if (match.a.empty()) return;  // reordered() takes an empty list for all points
        if (study_.error == "own") {
            own_ = std::max(own_, session_.study_error(reordered(points, match.a), reordered(reference, match.b)));
            return;
        }
        row_.rounding = std::max(row_.rounding, rounding_of(points, frames, time));
        for (std::size_t i = 0; i < match.a.size(); ++i)
            distances_.push_back(
                (points.P()[match.a[i]].cast<double>() - reference.P()[match.b[i]].cast<double>()).norm());
    }

    // Error: the run has no error that is a number.
    StudyRow row() const
    {
        if (!study_.compares() && !constrained_)
            throw Error("no constraint acts in the frames that are looked at, so that none has a residual");
        if (study_.compares() && row_.compared == 0)
            throw Error(
                fmt::format("no point is both in the run and in its reference ({} are in one of them)", row_.missing));
        StudyRow row = row_;
        row.error = norm();
        if (!std::isfinite(row.error)) throw Error(fmt::format("the error is {}, no finite number", row.error));
        return row;
    }

private:
    double norm() const
    {
        if (!study_.compares()) return residual_;
        if (study_.error == "own") return own_;
        if (study_.error == "p95") return p95_of(distances_);
        double squares = 0, largest = 0;
        for (const double distance : distances_) {
            squares += distance * distance;
            largest = distance <= largest ? largest : distance;  // NaN stays
        }
        return study_.error == "max" ? largest : std::sqrt(squares / static_cast<double>(distances_.size()));
    }

    const Study& study_;
    const Session& session_;
    StudyRow row_;
    double own_ = -std::numeric_limits<double>::infinity();
    double residual_ = 0;
    bool constrained_ = false;  // some frame had constraints
    std::vector<double> distances_;
};

// Computes all frames, and gives those that are compared to `keep`. Returns the time, s.
double run_frames(const Plan& plan, const Study& study,
                  const std::function<void(const FrameResult& result, const PointSet& points)>& keep)
{
    const std::string output = compared_output(plan);
    const Stopwatch stopwatch;
    Evaluator evaluator(plan);
    evaluator.leave_out_errors();
    while (evaluator.next_frame() <= study.last) {
        const FrameResult result = evaluator.advance();
        if (keep && is_compared(study, result.frame)) keep(result, result.outputs.at(output));
    }
    return stopwatch.seconds();
}

// Tells the error that `work` raises. It sets `started` when its first frame is due.
void guarded(const StudySource& source, const TellParent& tell, const std::function<void(bool& started)>& work)
{
    Threads threads(source.threads);
    bool started = false;
    std::string failed;
    try {
        threads.run([&] {
            const MemoryLimit limit(source.file, end_at_limit(tell));
            work(started);
        });
        return;
    } catch (const std::bad_alloc&) {
        failed = "out of memory";
    } catch (const std::exception& error) {
        failed = error.what();
    }
    tell({{"failed", failed}, {"refused", !started}});
}

}  // namespace

Study read_study(const json& event)
{
    const json& told = event.at("study");
    Study study;
    study.file = told.at("file");
    study.name = told.at("name");
    for (const auto& [knob, values] : told.at("sweep").items())
        for (const json& value : values) study.sweep[knob].push_back(value_of(value));
    study.lines = told.at("lines").get<std::vector<std::string>>();
    study.first = told.at("frames")[0];
    study.last = told.at("frames")[1];
    study.error = told.at("error");
    study.last_frame_only = told.at("last_frame_only");
    if (!told.at("reference").is_null()) {
        study.reference.emplace();
        for (const auto& [knob, value] : told.at("reference").items()) (*study.reference)[knob] = value_of(value);
    }
    study.repeat_runs = told.at("repeat_runs");
    return study;
}

void read_row(const json& event, StudyRow& row)
{
    const json& told = event.at("row");
    row.error = told.at("error");
    row.rounding = told.at("rounding");
    row.seconds = told.at("seconds").get<std::vector<double>>();
    row.compared = told.at("compared");
    row.missing = told.at("missing");
}

void describe_study(const StudySource& source, const Study& asked, bool default_frames, const TellParent& tell)
{
    guarded(source, tell, [&](bool&) {
        Study study = asked;
        if (source.is_graph) {
            // Loads it with the knobs of a row, so that a misspelt node is found before any run.
            Knobs knobs = study.rows().front();
            const StudyScene scene = load(source, knobs, tell);
            const Plan plan(scene.graph, {source.seed, {}});
            if (default_frames) {
                study.last += plan.first_frame() - study.first;
                study.first = plan.first_frame();
            }
        } else {
            study = load(source, {}, tell).session->study();
        }
        tell({{"study", to_event(study)}});
    });
}

void run_reference(const StudySource& source, const Study& study, const Knobs& knobs, PointStore& store,
                   const TellParent& tell)
{
    guarded(source, tell, [&](bool& started) {
        const StudyScene scene = load(source, knobs, tell);
        const Plan plan = plan_of(scene, source, study);
        started = true;
        run_frames(plan, study,
                   [&](const FrameResult& result, const PointSet& points) { store.keep(result.frame, points); });
        tell({{"kept", true}});
    });
}

void run_row(const StudySource& source, const Study& study, const Knobs& knobs, const PointStore& store,
             const TellParent& tell)
{
    guarded(source, tell, [&](bool& started) {
        const StudyScene scene = load(source, knobs, tell);
        Measure measure(study, *scene.session);
        std::vector<double> seconds;
        // The first run warms caches, compiled kernels and the allocator, and measures the error: each run of a scene
        // gives the same bits. Each run has a plan of its own, so that it does not reuse the shapes of another.
        for (int run = 0; run <= study.repeat_runs; ++run) {
            const Plan plan = plan_of(scene, source, study);
            started = true;
            if (run > 0) {
                seconds.push_back(run_frames(plan, study, {}));
            } else {
                std::uint64_t place = 0;
                const std::string output = compared_output(plan);
                run_frames(plan, study, [&](const FrameResult& result, const PointSet& points) {
                    if (!study.compares()) return measure.add(result.figures, points);
                    const double time = result.time.at(output), fps = result.fps.at(output);
                    const Frame frame{static_cast<double>(result.frame), time, 1 / fps};
                    const PointSet reference = study.reference ? store.read(result.frame, place)
                                                               : scene.session->study_reference(frame, knobs);
                    measure.add(points, reference, result.frame - plan.first_frame(), time);
                });
            }
            tell({{"run", run + 1}});
        }
        const StudyRow row = measure.row();
        tell({{"row",
               {{"error", row.error},
                {"rounding", row.rounding},
                {"seconds", seconds},
                {"compared", row.compared},
                {"missing", row.missing}}}});
    });
}

}  // namespace rapid
