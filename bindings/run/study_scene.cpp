#include "bindings/run/study_scene.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "runtime/base/stopwatch.h"
#include "runtime/graph/error_sources.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/override.h"
#include "runtime/io/compare.h"
#include "runtime/io/id_order.h"
#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"

namespace rapid {
namespace {

// Returns the output that is compared: main, or the only one.
std::string compared_output(const Plan& plan)
{
    if (plan.outputs.size() > 1 && !plan.outputs.count("main"))
        throw Error("the scene has several outputs, and none is called main; name the one to compare main");
    return plan.outputs.count("main") ? "main" : plan.outputs.begin()->first;
}

bool is_compared(const Study& study, std::int64_t frame)
{
    return study.last_frame_only ? frame == study.last : frame > study.first && frame <= study.last;
}

// Returns the rounding error of a position after n frames, m. The state is rounded to single precision once a frame:
// each frame adds up to half an ulp of P, and of v times the remaining time, in both directions, so that n such errors
// grow as sqrt(n).
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

    // Adds the largest residual of the frame's constraints.
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

    // Throws Error if the run has no numeric error.
    StudyRow row() const
    {
        if (!study_.compares() && !constrained_)
            throw Error("no constraint acts in the compared frames, so there is no residual");
        if (study_.compares() && row_.compared == 0)
            throw Error(
                fmt::format("the run and its reference have no point in common ({} are in one of them)", row_.missing));
        StudyRow row = row_;
        row.error = norm();
        if (!std::isfinite(row.error)) throw Error(fmt::format("the error is {}; it must be finite", row.error));
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

// Reads the next frame of a reference. Throws Error if it is a different one.
PointSet frame_of(const RecordLog& reference, std::int64_t frame, std::uint64_t& offset)
{
    std::string record;
    if (reference.read(offset, record))
        if (const StateFile file = StateFile::in_memory(std::move(record)); file.header().at("frame") == frame) {
            PointSet points;
            restore(points, file.state());
            return points;
        }
    throw Error(fmt::format("the reference has no frame {}", frame));
}

// Computes all frames, and passes those that are compared to `keep`. Returns the time, s.
double run_frames(const Plan& plan, const Study& study,
                  const std::function<void(const FrameResult& result, const PointSet& points)>& keep)
{
    const std::string output = compared_output(plan);
    const Stopwatch stopwatch;
    Evaluator evaluator(plan);
    evaluator.disable_error_estimates();
    while (evaluator.next_frame() <= study.last) {
        const FrameResult result = evaluator.advance();
        if (keep && is_compared(study, result.frame)) keep(result, result.outputs.at(output));
    }
    return stopwatch.seconds();
}

// A study file without knobs has no graph.
SessionOptions session_options(const StudySource& source, const Knobs& knobs)
{
    SessionOptions options = source.session;
    if (!source.is_scene) options.knobs = knobs;
    return options;
}

}  // namespace

Study read_study(const StudySource& source) { return Session(source.file, session_options(source, {})).study(); }

StudyScene::StudyScene(const Study& study, const StudySource& source, const Knobs& knobs)
    : study_(study),
      knobs_(knobs),
      session_(source.file, session_options(source, knobs)),
      graph_(source.is_scene ? with_arguments(session_.graph(), knobs) : session_.graph()),
      seed_(source.seed)
{
}

Plan StudyScene::plan() const
{
    Plan plan(graph_, {seed_, {}});
    if (study_.first < plan.first_frame())
        throw Error(fmt::format("frames: {} is before the scene's first frame, {}", study_.first, plan.first_frame()));
    return plan;
}

void StudyScene::keep_frames(RecordLog& log, const Progress& progress) const
{
    const Plan plan = this->plan();
    log.clear();
    progress(0);
    run_frames(plan, study_, [&](const FrameResult& result, const PointSet& points) {
        log.append(text_of_state({{"frame", result.frame}}, state_of(points)));
    });
    progress(1);
}

StudyRow StudyScene::measure(const RecordLog* reference, const Progress& progress) const
{
    Measure measure(study_, session_);
    std::vector<double> seconds;
    // The first run warms caches, compiled kernels and the allocator, and measures the error: all runs of a scene are
    // bit-identical. Each run has its own plan, so that it does not reuse the shapes of another.
    for (int run = 0; run <= study_.repeat_runs; ++run) {
        const Plan plan = this->plan();
        if (run == 0) progress(0);
        if (run > 0) {
            seconds.push_back(run_frames(plan, study_, {}));
        } else {
            std::uint64_t offset = 0;
            const std::string output = compared_output(plan);
            run_frames(plan, study_, [&](const FrameResult& result, const PointSet& points) {
                if (!study_.compares()) return measure.add(result.figures, points);
                const double time = result.time.at(output), fps = result.fps.at(output);
                const Frame frame{static_cast<double>(result.frame), time, 1 / fps};
                const PointSet compared = study_.reference ? frame_of(*reference, result.frame, offset)
                                                           : session_.study_reference(frame, knobs_);
                measure.add(points, compared, result.frame - plan.first_frame(), time);
            });
        }
        progress(run + 1);
    }
    StudyRow row = measure.row();
    for (UnmeasuredError& error : error_sources_of(plan()).unmeasured) row.unmeasured.push_back(std::move(error.text));
    row.knobs = knobs_;
    row.seconds = std::move(seconds);
    return row;
}

}  // namespace rapid
