// solve: advances the points by one frame under all that is upstream, lets them age and die, and hands them to Create
// for the next frame (paper §2.1).
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <type_traits>

#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/graph/stateful.h"
#include "runtime/operators/solve/aging.h"
#include "runtime/operators/solve/air_resistance.h"
#include "runtime/operators/solve/changing_dynamics.h"
#include "runtime/operators/solve/collider_shapes.h"
#include "runtime/operators/solve/point_figures.h"
#include "runtime/operators/solve/step_recorder.h"
#include "runtime/points/members.h"
#include "runtime/solver/collision/stuck_columns.h"
#include "runtime/solver/constraints/contact_state.h"
#include "runtime/solver/estimate/coupled_errors.h"
#include "runtime/solver/estimate/energy_drift.h"
#include "runtime/solver/estimate/error_control.h"
#include "runtime/solver/estimate/resolution.h"
#include "runtime/solver/estimate/shadow.h"
#include "runtime/solver/estimate/stiffness.h"
#include "runtime/solver/estimate/tolerance_check.h"
#include "runtime/solver/interaction.h"

namespace rapid {
namespace {

// Far above any scene's need: a run with more would not end, and gives no sign of it.
constexpr int most_substeps = 1 << 20, most_iterations = 10000;

struct Solve {
    int substeps, iterations, max_substeps;
    double sleep;
    std::optional<double> tolerance;
    std::string group;

    static NodeType declare()
    {
        return node<Solve>("solve", "Advances the points by one frame: forces, motion, collision.")
            .kind(NodeKind::Solve)
            .stage(Stage::Integration)
            .stage(Stage::ErrorEstimate)
            .takes("force")
            .takes("mass")
            .takes("life")
            .takes("airresist")
            .takes("targetv")
            .param(&Solve::substeps, "substeps", 1.0, between(1, most_substeps), "", "steps a frame")
            .param(&Solve::iterations, "iterations", 1.0, between(1, most_iterations), "",
                   "of the constraints, a sub-step")
            .param(&Solve::sleep, "sleep", 0.25, or_infinity(above(0)), "s",
                   "at rest, after which points with constraints sleep until something acts on them; math.huge: never")
            .param(&Solve::tolerance, "tolerance", Value(), above(0), "m a frame",
                   "each point takes as many sub-steps, twice as many and so on, as its own estimated error needs")
            .param(&Solve::max_substeps, "max_substeps", 64.0, between(1, most_substeps), "",
                   "the most, with a tolerance")
            .writes("P")
            .writes("v");
    }

    // Which steps it takes depends on whether all points have one value of these: the frame in one, where they do.
    std::string couples(const Plan& plan, const PlannedNode& node) const
    {
        const PlannedSimulation& simulation = plan.simulations[node.simulation];
        const auto has_group = [&](std::size_t writer) {
            const auto& arguments = plan.nodes[writer].node->arguments;
            const auto given = arguments.find("group");
            return given != arguments.end() && !given->second.is_nil();
        };
        for (const char* name : {"airresist", "targetv", "force"}) {
            const PlannedAttribute* attribute = simulation.find(name);
            if (!attribute || !attribute->kept) continue;
            const std::vector<std::size_t>& writers = attribute->written_by;
            if (attribute->made_by.size() > 1 || std::any_of(writers.begin(), writers.end(), has_group))
                return fmt::format("takes other steps where all points have the same {}", name);
        }
        return {};
    }

    // The initial state, before any dynamics: of the nodes upstream only Create has run.
    Flow start(std::span<Flow> inputs, const Evaluation&)
    {
        Flow flow = std::move(inputs[0]);
        flow.dynamics.clear();
        flow.simulation->state = flow.points;
        StepRecorder(*flow.simulation).start(flow.points);
        shadows_ = Shadows();
        coupled_errors_ = CoupledErrors();
        drift_ = EnergyDrift();
        tolerance_check_ = ToleranceCheck();
        if (flow.simulation->tells_points) PointFigures().put(flow.points);
        return flow;
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        if (auto drag = air_resistance_of(flow.points, now)) flow.dynamics.add(std::move(drag));
        require_in_range(flow, now);
        SolveOptions options = begin(flow, now);
        StepRecorder recorder(*flow.simulation);
        recorder.begin(flow.points, options, !tolerance);
        note_stiffness(flow, options, now);
        if (flow.simulation->trial) {
            now.figures.resolution = coarser(now.figures.resolution, resolution_of(flow.points, options.h));
            try_actions(flow, options);
            flow.simulation->state = flow.points;
            return flow;
        }
        // With a tolerance, the points of the sample are checked in any case.
        const bool estimates = flow.simulation->estimates_errors || tolerance;
        changing_.begin(flow.dynamics, options, tolerance ? max_substeps : 0, estimates, flow.points.has("dt"));
        const double begin_time = options.time - options.h;
        if (estimates) note_left_out(flow, now);
        if (estimates && !moves_alone(flow)) coupled_errors_.begin(flow.points, changing_.finer(), options);
        if (!options.interacts) interact(flow.points, changing_.run(), options, begin_time);
        if (estimates) begin_estimates(flow, options);
        PointFigures figures;
        if (flow.simulation->tells_points) figures.begin(flow.points, options, tolerance.has_value());
        const bool newborn = are_newborn(flow.points, options.h);
        const Tolerated done = advance(flow, options);
        if (newborn && flow.points.empty()) warn_of_deaths_at_birth(flow, now);
        const std::uint64_t beyond = check_tolerance(flow, options);
        if (!flow.dynamics.actions().empty()) require_in_range(flow, now);  // they write attributes
        if (estimates) estimate(flow, options, now, figures);
        if (!options.interacts) interact(flow.points, changing_.run(), options, options.time);
        if (estimates && !moves_alone(flow)) estimate_coupled(flow, now, figures);
        report(done, beyond, flow, now);
        recorder.end();
        const bool none_left = flow.points.empty();
        now.figures.died += age_points(flow.points, group, now.frame.dt, &recorder);
        if (newborn && !none_left && flow.points.empty())
            now.warnings.push_back(fmt::format(
                "node \"{}\": all points die in the frame of their birth; give them a longer life", now.node));
        feed_back(flow);
        if (flow.simulation->tells_points) {
            for (const SleepRecords::Record& record : sleep_records_.records) figures.note_asleep(record.id);
            figures.put(flow.points);
        }
        return flow;
    }

    static std::unique_ptr<Operator> make() { return stateful<Solve>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(shapes_, shadows_, coupled_errors_, drift_, tolerance_check_, loads_, sleep_records_);
    }

private:
    static bool is_coupled(const Flow& flow) { return !flow.dynamics.constraints().empty(); }
    // Whether neighbours act on each other at the ends of sub-steps.
    bool interacts(const Flow& flow) const { return !tolerance && !flow.dynamics.interactions().empty(); }

    // Whether no point's motion within the frame depends on another's.
    bool moves_alone(const Flow& flow) const { return !is_coupled(flow) && !interacts(flow); }

    // The attributes that stand for parameters are refused as constants are, by one scan of each.
    static void require_in_range(const Flow& flow, const Evaluation& now)
    {
        const auto frame = static_cast<std::int64_t>(std::ceil(now.frame.number));
        const PointSet& points = flow.points;
        flow.dynamics.visit_in_order([&](const auto& dynamic) {
            at_node(*dynamic, [&] {
                for (const AttributeRange& range : dynamic->ranges)
                    rapid::require_in_range(points, members_of(points, dynamic->group), range, frame);
            });
        });
        for (const AttributeRange& range : now.ranges)
            rapid::require_in_range(points, members_of(points, {}), range, frame);
    }

    SolveOptions begin(Flow& flow, const Evaluation& now)
    {
        const FrameClock clock = flow.simulation->clock();
        changing_.note_colliders(flow.dynamics);
        shapes_.prepare(flow.dynamics, flow.points, clock, tolerance ? 1 : substeps, now);
        if (is_coupled(flow) && !flow.points.has("still")) flow.points.add({"still", 0.0f});
        if (StuckColumns::are_needed(flow.dynamics)) StuckColumns::add_to(flow.points);
        if (tolerance && is_coupled(flow))
            throw Error(
                "a tolerance is for points that do not depend on one another, and there are constraints; give "
                "substeps instead");

        SolveOptions options;
        options.substeps = substeps;
        options.time = now.frame.time;
        options.h = now.frame.dt;
        options.frame = static_cast<std::int64_t>(std::ceil(now.frame.number));
        options.group = group;
        options.begins_frame = clock.is_whole(clock.step_at(now.frame) - 1);
        options.interacts = interacts(flow) && substeps > 1;
        options.iterations = iterations;
        options.loads = &loads_;
        options.sleep = sleep;
        options.sleep_records = &sleep_records_;
        return options;
    }

    // After 1, 2, 4, 8, ... steps, at little cost: stiffness changes as points move. With a tolerance the sub-steps are
    // chosen, and there is nothing to advise.
    void note_stiffness(const Flow& flow, const SolveOptions& options, const Evaluation& now) const
    {
        if (!std::has_single_bit(static_cast<std::uint64_t>(std::llround(options.time / options.h)))) return;
        std::vector<Stiffness> found = find_stiff(flow.points, flow.dynamics, options);
        if (tolerance) std::erase_if(found, [](const Stiffness& stiffness) { return !stiffness.is_exact(); });
        now.figures.stiff.insert(now.figures.stiff.end(), found.begin(), found.end());
    }

    Tolerated advance(Flow& flow, const SolveOptions& options) const
    {
        if (!tolerance) return {solve(flow.points, changing_.run(), options), substeps, 0};
        return solve_within(flow.points, changing_.run(), options, allowed_error(flow), max_substeps);
    }

    // Points beyond the tolerance, by a sample.
    std::uint64_t check_tolerance(const Flow& flow, const SolveOptions& options)
    {
        if (!tolerance || shadows_.idle()) return 0;
        return tolerance_check_.beyond(shadows_.before(), flow.points, changing_.finer(), options, allowed_error(flow),
                                       2 * max_substeps);
    }

    // m, in this step.
    double allowed_error(const Flow& flow) const { return *tolerance / flow.simulation->subframes; }

    // Parameters that are functions of the frame and in no error.
    void note_left_out(const Flow& flow, const Evaluation& now) const
    {
        const auto& varying = flow.simulation->varying;
        std::vector<std::string>& left_out = now.figures.left_out_of_errors;
        flow.dynamics.visit_in_order([&](const auto& dynamic) {
            using D = std::decay_t<decltype(*dynamic)>;
            if (tolerance && std::is_same_v<D, Interaction>)
                left_out.push_back(dynamic->node + ", whose kicks with a tolerance are at the ends of frames");
            const auto found = varying.find(dynamic->node);
            if (found == varying.end()) return;
            for (const std::string& param : found->second)
                left_out.push_back(
                    fmt::format("{}.{}, a function of the frame that is called once in each", dynamic->node, param));
        });
    }

    // Of coupled points a sample alone tells nothing but rounding.
    void begin_estimates(const Flow& flow, SolveOptions& options)
    {
        const bool alone = moves_alone(flow);
        const bool is_exact = is_closed_form(flow.points, changing_.run(), options);
        shadows_.begin(flow.points, !alone || is_exact, options.h);
        if (!alone) return;
        drift_.begin(flow.points, shadows_, changing_.run(), options);
    }

    void estimate(const Flow& flow, const SolveOptions& options, const Evaluation& now, PointFigures& figures)
    {
        std::optional<std::vector<double>> drift;
        if (!moves_alone(flow)) {
            shadows_.advance(flow.points, [](PointSet&) {});
        } else {
            const std::vector<double> errors = shadows_.advance(flow.points, [&](PointSet& shadows) {
                SolveOptions finer = options;
                finer.substeps *= 2;
                finer.met = nullptr;
                finer.taken = nullptr;
                finer.log = nullptr;
                if (tolerance)
                    solve_within(shadows, changing_.finer(), finer, allowed_error(flow) / 4, 2 * max_substeps);
                else
                    solve(shadows, changing_.finer(), finer);
            });
            now.figures.errors.insert(now.figures.errors.end(), errors.begin(), errors.end());
            if (flow.simulation->tells_points)
                shadows_.idle() ? figures.note_no_errors() : figures.note_errors(shadows_.ids(), errors);
            drift = drift_.end(flow.points, shadows_, changing_.run());
        }
        const double rounding = shadows_.rounding(!flow.dynamics.colliders().empty());
        now.figures.rounding = std::max(now.figures.rounding, rounding);
        if (drift)
            now.figures.energy_drift.insert(now.figures.energy_drift.end(), drift->begin(), drift->end());
        else
            now.figures.has_no_energy = true;
    }

    // After interactions at the frame's end.
    void estimate_coupled(const Flow& flow, const Evaluation& now, PointFigures& of_points)
    {
        const CoupledErrors::Errors errors = coupled_errors_.end(flow.points);
        FrameFigures& figures = now.figures;
        figures.errors.insert(figures.errors.end(), errors.since_birth.begin(), errors.since_birth.end());
        figures.frame_errors.insert(figures.frame_errors.end(), errors.of_frame.begin(), errors.of_frame.end());
        if (flow.simulation->tells_points)
            of_points.note_errors(errors.ids, errors.since_birth.empty() ? errors.of_frame : errors.since_birth);
        if (!errors.unknown.empty()) figures.left_out_of_errors.push_back(errors.unknown);
    }

    // Whether a shape that points meet knows its distance in a band only.
    static bool has_band(const Flow& flow)
    {
        const auto& colliders = flow.dynamics.colliders();
        return std::any_of(colliders.begin(), colliders.end(),
                           [](const auto& collider) { return std::isfinite(collider->shape->band()); });
    }

    // Whether there are points, all of which were born in this step.
    static bool are_newborn(const PointSet& points, double h)
    {
        const auto* own = points.find<float>("dt");
        if (points.empty() || !own) return false;
        const Strided<float> dt = own->read();
        for (std::size_t i = 0; i < points.size(); ++i)
            if (!(dt[i] < static_cast<float>(h))) return false;
        return true;
    }

    static void warn_of_deaths_at_birth(const Flow& flow, const Evaluation& now)
    {
        for (const auto& collider : flow.dynamics.colliders())
            if (collider->response == Response::Die) {
                now.warnings.push_back(
                    fmt::format("{}:{}: node \"{}\": kills all points where they are born: with response = \"die\" a "
                                "point dies within its radius (pscale) of the shape; give radius = 0, or let points be "
                                "born farther away",
                                collider->location.file, collider->location.line, collider->node));
                return;
            }
    }

    // In a trial: actions, which are scripts, may fail.
    static void try_actions(const Flow& flow, const SolveOptions& options)
    {
        if (flow.dynamics.actions().empty()) return;
        Dynamics actions;
        for (const auto& action : flow.dynamics.actions()) actions.add(action);
        SolveOptions once;
        once.time = options.time;
        once.h = options.h;
        once.frame = options.frame;
        PointSet points = flow.points;
        solve(points, actions, once);
    }

    // beyond: points, by the check of the tolerance.
    void report(const Tolerated& done, std::uint64_t beyond, const Flow& flow, const Evaluation& now) const
    {
        const SolveResult& result = done.result;
        FrameFigures& figures = now.figures;
        figures.substeps = std::max(figures.substeps, done.substeps);
        figures.collisions += result.collisions;
        figures.died += result.died;
        figures.contact_limit += result.contact_limit;
        figures.trapped += result.trapped;
        figures.constraint_rows += result.residual.rows;
        figures.loose_constraints += result.residual.loose;
        figures.broken += result.residual.broken;
        figures.asleep += result.asleep;
        if (result.residual.search) figures.contact_search = result.residual.search;
        figures.constraint_residual_max = std::max(figures.constraint_residual_max, result.residual.worst);
        figures.contact_energy += result.contact_energy;
        if (result.ledger && figures.ledger)
            figures.ledger->append(*result.ledger);
        else if (result.ledger)
            figures.ledger = result.ledger;
        figures.penetration_max = std::max(figures.penetration_max, result.penetration_max);
        figures.beyond_tolerance += std::max(done.beyond, beyond);

        const auto warn = [&](const std::string& text) {
            now.warnings.push_back(fmt::format("node \"{}\": {}", now.node, text));
        };
        if (result.contact_limit > 0)
            warn(
                "points reached the limit of contacts in a step, two thousand impacts, and rest where they are for "
                "what was left of it; take more substeps");
        if (result.residual.loose > 0)
            warn("constraints are off by more than a tenth of their size; take more substeps, or more iterations");
        if (result.ledger && result.ledger->residue && !result.ledger->residue->is_rounding())
            warn(
                fmt::format("constraints gave {:.1e} of the energy and {:.1e} of the momentum in motion that nothing "
                            "accounts for; take more substeps, or more iterations",
                            result.ledger->residue->energy, result.ledger->residue->momentum));
        if (result.trapped > 0)
            warn(has_band(flow)
                     ? "points are deep in a shape, where its field shows no way out; a level set of a larger "
                       "half_width shows it farther"
                     : "points are in a shape, with no way out: between shapes that leave no room, or in its middle; "
                       "let them be born outside, or move the shapes apart");
        if (done.beyond > 0)
            warn(
                fmt::format("points need more than {} sub-steps for an error of {:g} m a frame; raise max_substeps "
                            "or the tolerance",
                            done.substeps, *tolerance));
        if (beyond > done.beyond)
            warn(
                fmt::format("by a sample, {} points are farther than {:g} m from where other sub-steps take them: the "
                            "forces change within a sub-step; take more substeps to begin with",
                            beyond, *tolerance));
    }

    // The state keeps how long points have been still and what holds them; the output does not have those columns. The
    // copy shares the other columns, which are the state's alone as soon as the flow has been used.
    static void feed_back(Flow& flow)
    {
        flow.points.remove("dt");
        flow.dynamics.clear();
        flow.simulation->state = flow.points;
        flow.points.remove("still");
        StuckColumns::remove_from(flow.points);
    }

    ColliderShapes shapes_;
    Shadows shadows_;
    CoupledErrors coupled_errors_;
    ChangingDynamics changing_;
    EnergyDrift drift_;
    ToleranceCheck tolerance_check_;
    ShapeLoads loads_;            // of the previous frame, where points are coupled
    SleepRecords sleep_records_;  // of the previous frame
};
RAPID_NODE(Solve);
RAPID_COUPLING("solve", Solve);

}  // namespace
}  // namespace rapid
