// solve: advances the points by one frame under all that is upstream, lets them age and die, and hands them to the next
// frame's Create (paper §2.1).
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <map>

#include "runtime/graph/node.h"
#include "runtime/operators/solve/aging.h"
#include "runtime/parallel.h"
#include "runtime/points/members.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/motion/moving.h"
#include "runtime/solver/constraints/shape_contacts.h"
#include "runtime/solver/estimate/energy_drift.h"
#include "runtime/solver/estimate/error_control.h"
#include "runtime/solver/estimate/shadow.h"
#include "runtime/solver/estimate/stiffness.h"
#include "runtime/solver/interaction.h"
#include "runtime/stopwatch.h"

namespace rapid {
namespace {

// Of a level set; and of one whose band is wider than the shape itself, which takes some 4 s to fill and 1.5 GiB to
// hold: what keeps so large points out needs no such small voxels.
constexpr double most_voxels = 0x1p31, most_around = 0x1p27;

struct Solve {
    int substeps = 1, iterations = 1, max_substeps = 64;
    double sleep = 0.25;
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
            .param(&Solve::substeps, "substeps", 1.0, at_least(1), "", "steps a frame")
            .param(&Solve::iterations, "iterations", 1.0, at_least(1), "", "of the constraints, a sub-step")
            .param(&Solve::sleep, "sleep", 0.25, or_infinity(above(0)), "s",
                   "at rest, after which points with constraints sleep until something acts on them; math.huge: never")
            .param(&Solve::tolerance, "tolerance", Value(), above(0), "m a frame",
                   "each point takes as many sub-steps, twice as many and so on, as its own estimated error needs")
            .param(&Solve::max_substeps, "max_substeps", 64.0, at_least(1), "", "the most, with a tolerance")
            .writes("P")
            .writes("v");
    }

    // The initial state, before any dynamics: of the nodes upstream none but Create has run.
    Flow start(std::span<Flow> inputs, const Evaluation&)
    {
        Flow flow = std::move(inputs[0]);
        flow.dynamics.clear();
        flow.simulation->state = flow.points;
        shadows_ = Shadows();
        drift_ = EnergyDrift();
        return flow;
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        PointSet& points = flow.points;
        const FrameClock clock = flow.simulation->clock();
        widen(points, flow.dynamics, now);
        set_in_motion(points, flow.dynamics, clock, now);

        SolveOptions options;
        options.substeps = substeps;
        options.time = now.frame.time;
        options.h = now.frame.dt;
        options.frame = static_cast<std::int64_t>(std::ceil(now.frame.number));
        options.group = group;
        options.begins_frame = clock.is_whole(clock.step_at(now.frame) - 1);
        options.iterations = iterations;
        options.loads = &loads_;
        options.sleep = sleep;
        options.beds = &beds_;
        const bool coupled = !flow.dynamics.constraints().empty();
        if (coupled && !points.has("still")) points.add({"still", 0.0f});
        if (tolerance && coupled)
            throw Error(
                "a tolerance is for points that do not depend on one another, and there are constraints; give "
                "substeps instead");

        note_stiffness(points, flow.dynamics, options, now);
        if (flow.simulation->trial) {
            flow.simulation->state = points;
            return flow;
        }
        const double allowed = tolerance ? *tolerance / clock.subframes : 0;  // m, in this step
        interact(points, flow.dynamics, options);
        if (!coupled) {
            shadows_.begin(points, is_closed_form(points, flow.dynamics, options));
            drift_.begin(points, shadows_, flow.dynamics, options);
        }
        const Tolerated done = tolerance ? solve_within(points, flow.dynamics, options, allowed, max_substeps)
                                         : Tolerated{solve(points, flow.dynamics, options), substeps, 0};
        std::vector<double> errors;
        std::optional<std::vector<double>> drift;
        if (!coupled) {  // a part of the points alone would tell nothing: the residual is what says how wrong they are
            errors = shadows_.advance(points, [&](PointSet& shadows) {
                SolveOptions finer = options;
                finer.substeps *= 2;
                finer.met = nullptr;
                if (tolerance)
                    solve_within(shadows, flow.dynamics, finer, allowed / 4, 2 * max_substeps);
                else
                    solve(shadows, flow.dynamics, finer);
            });
            drift = drift_.end(points, shadows_, flow.dynamics);
        }
        interact(points, flow.dynamics, options);
        const SolveResult& result = done.result;
        now.figures.substeps = std::max(now.figures.substeps, done.substeps);
        now.figures.errors.insert(now.figures.errors.end(), errors.begin(), errors.end());
        if (drift)
            now.figures.energy_drift.insert(now.figures.energy_drift.end(), drift->begin(), drift->end());
        else
            now.figures.has_no_energy = true;
        now.figures.collisions += result.collisions;
        now.figures.died += result.died;
        now.figures.contact_limit += result.contact_limit;
        now.figures.trapped += result.trapped;
        now.figures.constraint_rows += result.residual.rows;
        now.figures.loose_constraints += result.residual.loose;
        now.figures.asleep += result.asleep;
        if (result.residual.search) now.figures.contact_search = result.residual.search;
        now.figures.constraint_residual_max = std::max(now.figures.constraint_residual_max, result.residual.worst);
        now.figures.contact_energy += result.contact_energy;
        now.figures.penetration_max = std::max(now.figures.penetration_max, result.penetration_max);

        if (result.contact_limit > 0)
            now.warnings.push_back(
                fmt::format("node \"{}\": points reached the limit of contacts in a step, and the rest of it was "
                            "dropped; take more substeps",
                            now.node));
        if (result.residual.loose > 0)
            now.warnings.push_back(
                fmt::format("node \"{}\": constraints are off by more than a tenth of their size; take more substeps, "
                            "or more iterations",
                            now.node));
        if (result.trapped > 0)
            now.warnings.push_back(
                fmt::format("node \"{}\": points are deep in a shape, where its field shows no way out; a level set of "
                            "a larger half_width shows it farther",
                            now.node));

        if (done.beyond > 0)
            now.warnings.push_back(
                fmt::format("node \"{}\": points need more than {} sub-steps for an error of {:g} m a frame; raise "
                            "max_substeps or the tolerance",
                            now.node, done.substeps, *tolerance));
        now.figures.beyond_tolerance += done.beyond;

        age(points, now);
        points.remove("dt");
        flow.dynamics.clear();
        // How long points have been still is the state's own matter.
        // Pointers: the values are the state's alone again as soon as the flow has been used.
        flow.simulation->state = points;
        points.remove("still");
        return flow;
    }

private:
    // After 1, 2, 4, 8, ... steps: what is stiff changes as points go on, and is looked for at little cost. With a
    // tolerance the sub-steps are chosen, and there is nothing to advise.
    void note_stiffness(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options,
                        const Evaluation& now) const
    {
        if (!std::has_single_bit(static_cast<std::uint64_t>(std::llround(options.time / options.h)))) return;
        std::vector<Stiffness> found = find_stiff(points, dynamics, options);
        if (tolerance) std::erase_if(found, [](const Stiffness& stiffness) { return !stiffness.is_exact(); });
        now.figures.stiff.insert(now.figures.stiff.end(), found.begin(), found.end());
    }

    // The values of a chunk one after the other, in the buffer where all share one.
    template <class T>
    static const T* contiguous(const Strided<T>& values, std::size_t begin, std::size_t end, T* buffer)
    {
        if (values.stride != 0) return values.data + begin;
        std::fill_n(buffer, end - begin, *values.data);
        return buffer;
    }

    void age(PointSet& points, const Evaluation& now) const
    {
        auto* ages = points.find<float>("age");
        if (!ages || points.empty()) return;
        const Aging aging(now.frame.dt);
        const float h = static_cast<float>(now.frame.dt);
        const Column<float>* own = points.find<float>("dt");
        const Strided<float> dt = own ? own->read() : Strided<float>{&h, 0};
        const auto* lives = points.find<float>("life");
        const float immortal = std::numeric_limits<float>::infinity();
        const Strided<float> life = lives ? lives->read() : Strided<float>{&immortal, 0};

        const Strided<std::uint8_t> members = members_of(points, group);

        const auto keep = std::make_unique_for_overwrite<std::uint8_t[]>(points.size());
        const std::span<float> age = ages->write();
        for_each_chunk(points.size(), [&, h](std::size_t begin, std::size_t end) {
            // Contiguous, so that the loops are over vectors.
            float dts[chunk_size], lives_until[chunk_size], whole[chunk_size];
            std::uint8_t alike[chunk_size];
            const float* __restrict t = contiguous(dt, begin, end, dts);
            const float* __restrict last = contiguous(life, begin, end, lives_until);
            const std::uint8_t* __restrict ages_here = contiguous(members, begin, end, alike);
            float* __restrict a = age.data() + begin;
            std::uint8_t* __restrict stays = keep.get() + begin;
            const std::size_t size = end - begin;
            for (std::size_t i = 0; i < size; ++i) whole[i] = aging.after_frame(a[i]);
            for (std::size_t i = 0; i < size; ++i) {
                const float part = a[i] + t[i], later = t[i] == h ? whole[i] : part;
                a[i] = ages_here[i] ? later : a[i];
                stays[i] = a[i] < last[i];
            }
        });
        const std::size_t before = points.size();
        if (lives) points.keep({keep.get(), points.size()});
        now.figures.died += before - points.size();
    }

    // How far from its surface a level set is asked (§4.3): two voxels beyond the largest radius, for the cells at the
    // band's edge; and where points are put back after their steps, as deep as a step takes them.
    double needed_band(const Collider& collider, const PointSet& points, double voxel, const Box3d& bounds,
                       double h) const
    {
        // As single precision has it, in which a grid keeps its half width.
        const double needed = (largest_radius(collider, points) + 2 * voxel) * (1 - 0x1p-20);
        if (collider.method == Method::Continuous) return needed;
        float fastest2 = 0;
        const Strided<Vec3f> v = points.v().read();
        for (std::size_t i = 0; i < points.size(); ++i) fastest2 = std::max(fastest2, v[i].squaredNorm());
        // In steps of a factor of two, so that points that gather speed do not have it built in every frame.
        const double way = std::sqrt(fastest2) * h / (tolerance ? 1 : substeps);
        double deep = voxel;
        while (deep < way) deep *= 2;
        return needed + std::min(deep, 0.5 * bounds.sizes().minCoeff());
    }

    // Level sets are widened once for each shape, and only as far as it takes.
    void widen(const PointSet& points, Dynamics& dynamics, const Evaluation& now)
    {
        std::map<ShapePtr, LevelSetPtr> wide;
        for (std::size_t i = 0; i < dynamics.colliders().size(); ++i) {
            const std::shared_ptr<const Collider> collider = dynamics.colliders()[i];
            const auto level_set = std::dynamic_pointer_cast<const LevelSet>(collider->shape);
            if (!level_set) continue;
            const double needed = needed_band(*collider, points, level_set->voxel(), level_set->bounds(), now.frame.dt);
            const auto known = wide_.find(collider->shape);
            LevelSetPtr shape = known == wide_.end() ? level_set : known->second;
            const Stopwatch stopwatch;
            if (const auto other = wide.find(collider->shape); other != wide.end() && other->second->band() >= needed)
                shape = other->second;
            const bool builds = shape->band() < needed;
            if (builds) shape = widened_to(shape, needed, *collider);
            wide[collider->shape] = shape;
            now.figures.bands.push_back(
                {collider->node, shape->band(), shape->active_voxels(), builds ? stopwatch.seconds() : 0});
            if (shape == level_set) continue;
            auto widened = std::make_shared<Collider>(*collider);
            widened->shape = shape;
            dynamics.replace_collider(i, std::move(widened));
        }
        wide_ = std::move(wide);
    }

    static LevelSetPtr widened_to(const LevelSetPtr& shape, double needed, const Collider& collider)
    {
        // Of the shell that its bounds make.
        const Eigen::Array3d size = shape->bounds().sizes().array() / shape->voxel();
        const double band = needed / shape->voxel();
        const double voxels = (size + 2 * band).prod() - (size - 2 * band).max(0).prod();
        const double most = band > size.maxCoeff() ? most_around : most_voxels;
        if (voxels > most)
            throw Error(
                fmt::format("points with a radius of {:.4g} m need a band of {:.0f} voxels of {:g} m around its "
                            "level set, some {:.1e} in all; at most {:.1e} fit: give it a larger voxel",
                            needed - 2 * shape->voxel(), band, shape->voxel(), voxels, most))
                .in_node(collider.node)
                .at(collider.location);
        return shape->with_band(needed);
    }

    // Shapes that move, in their way through this frame.
    void set_in_motion(const PointSet& points, Dynamics& dynamics, const FrameClock& clock, const Evaluation& now)
    {
        std::map<std::string, Deformation> deforming;
        for (std::size_t i = 0; i < dynamics.colliders().size(); ++i) {
            const std::shared_ptr<const Collider> collider = dynamics.colliders()[i];
            if (!collider->motion && !collider->deforming) continue;
            auto going = std::make_shared<Collider>(*collider);
            PathOptions options;
            options.cuts = collider->cuts;
            const std::int64_t step = clock.step_at(now.frame);
            const double to = now.frame.number, from = clock.at_step(step - 1).number;
            std::optional<Jump> jump;
            try {
                if (collider->deforming) {
                    const auto known = deforming_.find(collider->node);
                    const bool same = known != deforming_.end() && known->second.body() == collider->deforming;
                    Deformation& body =
                        deforming.emplace(collider->node, same ? known->second : Deformation(collider->deforming))
                            .first->second;
                    const double band = needed_band(*collider, points, collider->deforming->voxel(),
                                                    collider->deforming->bounds(), now.frame.dt);
                    const Stopwatch stopwatch;
                    Deformation::Interval interval =
                        body.over({clock.fps, clock.start}, from, to, collider->motion, options, band);
                    const LevelSet& built = *body.at_end();
                    now.figures.bands.push_back(
                        {collider->node, built.band(), built.active_voxels(), stopwatch.seconds()});
                    going->shape = std::move(interval.shape);
                    jump = interval.jump;
                } else {
                    const AnimatedShape body(collider->shape, collider->motion);
                    const FramePath path = path_of(body, clock, step, options);
                    jump = path.jump;
                    going->shape = path.kind == FramePath::AfterCut
                                       ? moving(collider->shape, *going_back(collider->motion, clock, to, path.after),
                                                clock, from, to)
                                       : moving(collider->shape, *collider->motion, clock, from, to);
                }
            } catch (Error& error) {
                error.in_node(collider->node).at(collider->location);
                throw;
            }
            if (jump)
                now.warnings.push_back(fmt::format(
                    "{}:{}: node \"{}\": the shape {}; nothing is swept along on the way (cut = {{{}}} says "
                    "so, cut = {{}} that it is no jump)",
                    collider->location.file, collider->location.line, collider->node,
                    describe(*jump, static_cast<std::int64_t>(std::ceil(to))),
                    static_cast<std::int64_t>(std::ceil(to))));
            going->motion = nullptr;
            going->deforming = nullptr;
            dynamics.replace_collider(i, std::move(going));
        }
        deforming_ = std::move(deforming);
    }

    static double largest_radius(const Collider& collider, const PointSet& points)
    {
        const Strided<float> radius = radii_of(collider.radius, points);
        float largest = 0;
        for (std::size_t i = 0; i < (radius.stride ? points.size() : 1); ++i) largest = std::max(largest, radius[i]);
        return largest;
    }

    Shadows shadows_;
    EnergyDrift drift_;
    // Of the frame before.
    ShapeLoads loads_;  // of coupled points
    SleepMemory beds_;  // of those that sleep
    std::map<ShapePtr, LevelSetPtr> wide_;
    std::map<std::string, Deformation> deforming_;  // by collide node
};
RAPID_NODE(Solve);

}  // namespace
}  // namespace rapid
