#include "runtime/operators/solve/step_observers.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <type_traits>

#include "runtime/points/id_index.h"
#include "runtime/shapes/shape.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_state.h"
#include "runtime/solver/estimate/coupled_errors.h"
#include "runtime/solver/estimate/energy_drift.h"
#include "runtime/solver/estimate/error_control.h"
#include "runtime/solver/estimate/resolution.h"
#include "runtime/solver/estimate/shadow.h"
#include "runtime/solver/estimate/stiffness.h"
#include "runtime/solver/interaction.h"

namespace rapid {
namespace {

template <class T>
void append(std::vector<T>& to, const std::vector<T>& more)
{
    to.insert(to.end(), more.begin(), more.end());
}

// Records the events of a step if an emitter uses the simulation as its source (StepRecord). With a tolerance, points
// go through the step several times, and contacts are not recorded.
class StepRecorder final : public StepObserver {
public:
    bool observes(const Step& step) const override { return step.flow.simulation->record != nullptr; }

    void start(Flow& flow) override
    {
        Simulation& simulation = *flow.simulation;
        if (!simulation.record) return;
        *simulation.record = StepRecord();
        simulation.record->before = flow.points;
        simulation.first_new = simulation.next_id;
    }

    void begin(Step& step, const PointSet& entered) override
    {
        Simulation& simulation = *step.flow.simulation;
        StepRecord& record = *simulation.record = StepRecord();
        record.time = step.options.time;
        record.h = step.options.h;
        record.first_new = std::exchange(simulation.first_new, simulation.next_id);
        record.before = entered;
        record.has_contacts = !step.tolerance;
        log_.reset();
        if (record.has_contacts) step.options.sinks.log = &log_.emplace(entered.size());
    }

    void end(Step& step, const PointSet&) override
    {
        if (!log_) return;
        StepRecord& record = *step.flow.simulation->record;
        record.hits = log_->hits();
        record.breaks = log_->breaks();
        record.killed = log_->dead();
        record.killed_at = log_->died_at();
        log_.reset();
    }

    void before_removal(const Step& step, std::span<const std::uint8_t> stays) override
    {
        std::vector<std::uint32_t> indices;
        for (std::size_t i = 0; i < stays.size(); ++i)
            if (!stays[i]) indices.push_back(static_cast<std::uint32_t>(i));
        if (indices.empty()) return;
        StepRecord& record = *step.flow.simulation->record;
        const PointSet& old = record.old = step.flow.points.select(indices);
        const Strided<float> age = old.column<float>("age").read(), life = old.column<float>("life").read();
        for (std::size_t i = 0; i < old.size(); ++i)
            record.old_at.push_back(record.time - std::max(0.0, double(age[i]) - double(life[i])));
    }

private:
    std::optional<StepLog> log_;
};

// Examines the points before some steps for stiff forces and actions. With a tolerance, substeps are chosen
// automatically and there is no advice to give.
class Examination final : public StepObserver {
public:
    bool observes(const Step&) const override { return true; }

    void begin(Step& step, const PointSet& entered) override
    {
        const SolveOptions& options = step.options;
        if (step.is_examined()) {
            std::vector<Stiffness> found = find_stiff(entered, step.flow.dynamics, options);
            if (step.tolerance) std::erase_if(found, [](const Stiffness& stiffness) { return !stiffness.is_exact(); });
            append(step.now.figures.stiff, found);
        }
        Trial* const trial = step.flow.simulation->trial.get();
        if (!trial) return;
        trial->resolution = coarser(trial->resolution, resolution_of(entered, options.h));
        if (!step.flow.dynamics.actions().empty()) try_actions(step, entered);
    }

private:
    // Actions are scripts and may fail.
    static void try_actions(const Step& step, PointSet points)
    {
        Dynamics actions;
        for (const auto& action : step.flow.dynamics.actions()) actions.add(action);
        SolveOptions once;
        once.time = step.options.time;
        once.h = step.options.h;
        once.frame = step.options.frame;
        solve(points, actions, once);
    }
};

// Estimates errors: from a sample of the points if each moves alone, otherwise from all of them. For coupled points, a
// sample shows only rounding.
class ErrorEstimate final : public StepObserver {
public:
    bool observes(const Step& step) const override { return StepObserver::observes(step) && step.estimates_errors(); }

    void begin(Step& step, const PointSet& entered) override
    {
        note_excluded(step);
        const PointSet& points = step.flow.points;
        const bool alone = step.moves_alone();
        const auto& arrivals = step.flow.simulation->arrivals;
        const auto arrives = [&](const PointSet& set, std::size_t i) {
            return std::any_of(arrivals.begin(), arrivals.end(),
                               [&](const auto& of_node) { return of_node.second(set, i); });
        };
        shadows_.begin(points, !alone || is_closed_form(points, step.run, step.options), step.options.h, arrives);
        if (alone)
            drift_.begin(points, shadows_, step.run, step.options);
        else
            coupled_.begin(entered, step.finer, step.options);
    }

    void end(Step& step, const PointSet& moved) override
    {
        FrameFigures& figures = step.now.figures;
        std::optional<std::vector<double>> drift;
        if (step.moves_alone()) {
            check_tolerance(step, moved);
            compare_sample(step, moved);
            drift = drift_.end(moved, shadows_, step.run);
        } else {
            shadows_.advance(moved, [](PointSet&) {});
            compare_all(step);
        }
        const double rounding = shadows_.rounding(!step.flow.dynamics.colliders().empty());
        figures.rounding = std::max(figures.rounding, rounding);
        if (drift)
            append(figures.energy_drift.values, *drift);
        else
            figures.energy_drift.is_defined = false;
    }

    void save(StateWriter& to) const override { to(shadows_, coupled_, drift_, tolerance_check_); }
    void load(StateReader& from) override { from(shadows_, coupled_, drift_, tolerance_check_); }

private:
    // Notes parameters that are functions of the frame and not included in the errors.
    static void note_excluded(const Step& step)
    {
        const auto& varying = step.flow.simulation->varying;
        std::vector<std::string>& excluded = step.now.figures.left_out_of_errors;
        step.flow.dynamics.visit_in_order([&](const auto& dynamic) {
            using D = std::decay_t<decltype(*dynamic)>;
            if (step.tolerance && std::is_same_v<D, Interaction>)
                excluded.push_back(dynamic->node + ", whose kicks with a tolerance are at the ends of frames");
            const auto found = varying.find(dynamic->node);
            if (found == varying.end()) return;
            for (const std::string& param : found->second)
                excluded.push_back(
                    fmt::format("{}.{}, a function of the frame that is called once in each", dynamic->node, param));
        });
    }

    // Must be called while the shadows are in their state before the step.
    void check_tolerance(Step& step, const PointSet& moved)
    {
        if (!step.tolerance || shadows_.idle()) return;
        step.beyond_tolerance = tolerance_check_.beyond_tolerance(shadows_.before(), moved, step.finer, step.options,
                                                                  step.allowed_error(), 2 * step.max_substeps);
    }

    void compare_sample(Step& step, const PointSet& moved)
    {
        std::vector<double> errors = shadows_.advance(moved, [&](PointSet& shadows) {
            SolveOptions finer = step.options;
            finer.substeps *= 2;
            finer.sinks = {};
            step.advance(shadows, step.finer, finer, 2);
        });
        append(step.now.figures.error.values, errors);
        step.is_exact = shadows_.idle();
        if (!step.is_exact) step.note_errors(shadows_.ids(), std::move(errors));
    }

    void compare_all(Step& step)
    {
        CoupledErrors::Errors found = coupled_.end(step.flow.points);
        FrameFigures& figures = step.now.figures;
        append(figures.error.values, found.since_birth);
        append(figures.frame_error.values, found.of_frame);
        if (!found.unknown.empty()) figures.left_out_of_errors.push_back(found.unknown);
        step.note_errors(found.ids, std::move(found.since_birth.empty() ? found.of_frame : found.since_birth));
    }

    Shadows shadows_;
    CoupledErrors coupled_;
    EnergyDrift drift_;
    ToleranceCheck tolerance_check_;
};

// Reports the solver's counts.
class StepReport final : public StepObserver {
public:
    void begin(Step& step, const PointSet&) override { all_newborn_ = are_newborn(step.flow.points, step.options.h); }

    void end(Step& step, const PointSet& moved) override
    {
        if (all_newborn_ && moved.empty()) warn_of_deaths_at_birth(step);
        count(step);
        warn(step);
    }

    void before_removal(const Step& step, std::span<const std::uint8_t> stays) override
    {
        if (all_newborn_ && std::find(stays.begin(), stays.end(), 1) == stays.end())
            step.warn("all points die in the frame of their birth; give them a longer life");
    }

private:
    // Returns true if there are points and all of them were born in this step.
    static bool are_newborn(const PointSet& points, double h)
    {
        const auto* own = points.find<float>("dt");
        if (points.empty() || !own) return false;
        const Strided<float> dt = own->read();
        for (std::size_t i = 0; i < points.size(); ++i)
            if (!(dt[i] < static_cast<float>(h))) return false;
        return true;
    }

    static void warn_of_deaths_at_birth(const Step& step)
    {
        for (const auto& collider : step.flow.dynamics.colliders())
            if (collider->response == Response::Die)
                return warn_of(step, *collider,
                               "kills all points at birth: with response = \"die\" a point dies within its radius "
                               "(pscale) of the shape; give radius = 0, or emit points farther away");
    }

    // Returns true if it has warned.
    static bool warn_of_overlapping_births(const Step& step)
    {
        bool warned = false;
        for (const auto& constraint : step.flow.dynamics.constraints()) {
            if (!constraint->births_overlap()) continue;
            warn_of(step, *constraint,
                    "points are created inside each other; give it a smaller radius, or create fewer points, farther "
                    "apart");
            warned = true;
        }
        return warned;
    }

    static void warn_of(const Step& step, const Dynamic& dynamic, const std::string& text)
    {
        step.now.warnings.push_back(
            fmt::format("{}:{}: node \"{}\": {}", dynamic.location.file, dynamic.location.line, dynamic.node, text));
    }

    static void count(const Step& step)
    {
        FrameFigures figures = step.done;
        figures.beyond_tolerance = std::max(figures.beyond_tolerance, step.beyond_tolerance);
        step.now.figures.add(figures);
    }

    static void warn(const Step& step)
    {
        const FrameFigures& result = step.done;
        if (result.contact_limit > 0)
            step.warn(
                "some points reached the limit of 2,000 impacts in one step and were stopped for the rest of it; give "
                "more substeps");
        warn_of_loose(step);
        if (result.ledger && result.ledger->residue && !result.ledger->residue->is_rounding())
            step.warn(
                fmt::format("constraints changed the energy by {:.1e} and the momentum by {:.1e} of their amounts "
                            "without a cause; give more substeps or iterations",
                            result.ledger->residue->energy, result.ledger->residue->momentum));
        if (result.trapped > 0)
            step.warn(has_band(step.flow.dynamics)
                          ? "some points are so deep in a shape that its level set has no gradient there; give the "
                            "level set a larger half_width"
                          : "some points can't leave a shape, because they are in its middle or between shapes without "
                            "room; emit them outside, or move the shapes apart");
        if (result.beyond_tolerance > 0)
            step.warn(
                fmt::format("some points need more than {} substeps for an error of {:g} m per frame; raise "
                            "max_substeps or the tolerance",
                            result.substeps, *step.tolerance));
        if (step.beyond_tolerance > result.beyond_tolerance)
            step.warn(
                fmt::format("a sample suggests that about {} points differ by more than {:g} m with other substeps, "
                            "because forces change within a substep; begin with more substeps",
                            step.beyond_tolerance, *step.tolerance));
    }

    // Warns of violated constraints, and of points that may pass through each other in a substep without one.
    static void warn_of_loose(const Step& step)
    {
        constexpr int passing = 3;  // times as long as the needed substep
        const bool loose = step.done.loose_constraints > 0;
        const int taken = step.options.substeps;
        const int needed = loose && step.needed == 0 ? step.needed_substeps(step.options.iterations) : step.needed;
        const std::string more = needed > taken ? fmt::format("{} substeps", needed) : "more substeps or iterations";
        if (loose && !warn_of_overlapping_births(step))
            step.warn(
                "some constraints are violated by more than a tenth of their size; if points overlap at birth, give "
                "fewer points or a smaller radius, otherwise " +
                more);
        if (!loose && needed > passing * taken)
            step.warn(fmt::format("points in contact may pass through each other in {} substep{}; give {}", taken,
                                  taken == 1 ? "" : "s", more));
    }

    // Returns true if any collider's shape knows its distance only within a band.
    static bool has_band(const Dynamics& dynamics)
    {
        return std::any_of(dynamics.colliders().begin(), dynamics.colliders().end(),
                           [](const auto& collider) { return std::isfinite(collider->shape->band()); });
    }

    bool all_newborn_ = false;
};

// Adds per-point figures to the result of Solve as attributes, for inspection (Evaluator::add_per_point_diagnostics):
//
//   error     m, the estimated error of the position; nan if the point is not in the sample
//   substeps  that the frame took for the point
//   asleep    1 for sleeping points, else 0
//
// They are not part of the state. A scene's own attribute with one of these names is kept.
class PointFigures final : public StepObserver {
public:
    bool observes(const Step& step) const override
    {
        return StepObserver::observes(step) && step.flow.simulation->per_point_diagnostics;
    }

    // Nothing has moved yet.
    void start(Flow& flow) override
    {
        if (flow.simulation->per_point_diagnostics) annotate(flow.points);
    }

    // Points take individual substeps if there is a tolerance.
    void begin(Step& step, const PointSet& entered) override
    {
        substeps_ = step.options.substeps;
        if (!step.tolerance) return;
        ids_ = entered.id();
        taken_.assign(entered.size(), substeps_);
        step.options.sinks.taken = taken_.data();
    }

    void end(Step& step, const PointSet&) override
    {
        is_exact_ = step.is_exact;
        known_ = std::move(step.ids);
        errors_.assign(step.errors.begin(), step.errors.end());
        asleep_.clear();
        for (const SleepRecords::Record& record : step.options.sleep_records->records) asleep_.push_back(record.id);
    }

    void annotate(PointSet& points) override
    {
        const IdIndex indices(points.id());
        // Adds a column with this value, and other values at the points with these ids.
        const auto add = [&]<class T, class V>(const char* name, T all, T fallback, Strided<std::int64_t> ids,
                                               const std::vector<V>& values) {
            if (points.has(name)) return;
            Column<T> column(points.size(), all, fallback);
            if (!values.empty() && !points.empty()) {
                const std::span<T> to = column.write();
                for (std::size_t k = 0; k < values.size(); ++k)
                    if (const std::uint32_t i = indices[ids[k]]; i != IdIndex::none) to[i] = values[k];
            }
            points.set(name, std::move(column));
        };
        constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
        add("error", is_exact_ ? 0.0f : unknown, unknown, {known_.data(), 1}, errors_);
        add("substeps", substeps_, std::int32_t{0}, ids_.read(), taken_);
        add("asleep", std::int32_t{0}, std::int32_t{0}, {asleep_.data(), 1},
            std::vector<std::int32_t>(asleep_.size(), 1));
    }

private:
    bool is_exact_ = true;
    std::int32_t substeps_ = 0;
    Column<std::int64_t> ids_;                  // as the points entered Solve
    std::vector<std::int32_t> taken_;           // in their order; empty if all take substeps_
    std::vector<std::int64_t> known_, asleep_;  // ids
    std::vector<float> errors_;                 // m, by known_
};

}  // namespace

int Step::needed_substeps(int iterations) const
{
    // The points of a group may be the pile: of the accelerations with and without that of each group, the largest
    // counts.
    Vec3d common = Vec3d::Zero();
    std::map<std::string, Vec3d> of_groups;
    for (const auto& force : flow.dynamics.forces())
        if (const std::optional<Uniform> uniform = force->uniform())
            (force->group.empty() ? common : of_groups.try_emplace(force->group, Vec3d::Zero()).first->second) +=
                uniform->a;
    Vec3d acceleration = common;
    for (const auto& [group, a] : of_groups)
        if ((common + a).norm() > acceleration.norm()) acceleration = common + a;
    double of_one = 1;  // iteration
    for (const auto& constraint : flow.dynamics.constraints())
        at_node(*constraint, [&] {
            of_one = std::max(of_one, constraint->needed_substeps(flow.points, acceleration, now.frame.dt));
        });
    return static_cast<int>(std::min(std::ceil(of_one / std::sqrt(iterations)), double(substep_limit)));
}

bool Step::is_examined() const
{
    return std::has_single_bit(static_cast<std::uint64_t>(std::llround(now.frame.time / now.frame.dt)));
}

double Step::allowed_error() const { return *tolerance / flow.simulation->subframes; }

FrameFigures Step::advance(PointSet& points, const Dynamics& dynamics, const SolveOptions& with, int finer_by) const
{
    if (tolerance)
        return solve_within(points, dynamics, with, allowed_error() / (finer_by * finer_by), finer_by * max_substeps);
    FrameFigures figures = solve(points, dynamics, with);
    figures.substeps = with.substeps;
    return figures;
}

void Step::note_errors(std::span<const std::int64_t> of, std::vector<double> found)
{
    ids.assign(of.begin(), of.end());
    errors = std::move(found);
}

void Step::warn(const std::string& text) const
{
    now.warnings.push_back(fmt::format("node \"{}\": {}", now.node, text));
}

StepObservers::StepObservers()
{
    const auto add = [&](auto observer) { all_.push_back(std::move(observer)); };
    add(std::make_unique<StepRecorder>());
    add(std::make_unique<Examination>());
    add(std::make_unique<ErrorEstimate>());
    add(std::make_unique<StepReport>());
    add(std::make_unique<PointFigures>());
}

void StepObservers::start(Flow& flow)
{
    *this = StepObservers();
    for (const auto& observer : all_) observer->start(flow);
}

void StepObservers::begin(Step& step, const PointSet& entered)
{
    observing_.clear();
    for (const auto& observer : all_)
        if (observer->observes(step)) observing_.push_back(observer.get());
    for (StepObserver* observer : observing_) observer->begin(step, entered);
}

}  // namespace rapid
