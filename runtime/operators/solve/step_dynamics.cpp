#include "runtime/operators/solve/step_dynamics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#include "runtime/base/stopwatch.h"
#include "runtime/points/members.h"
#include "runtime/points/per_point.h"
#include "runtime/shapes/motion/level_set_sequence.h"
#include "runtime/shapes/motion/moving.h"
#include "runtime/solver/changing.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/step_context.h"

namespace rapid {
namespace {

// Limits of voxels for a level set, and for one whose band is wider than the shape itself, which takes about 4 s to
// fill and 1.5 GiB to store: points that large collide well without such small voxels.
constexpr double max_voxels = 0x1p31, max_voxels_of_wide_band = 0x1p27;

LevelSetPtr widened_to(const LevelSetPtr& shape, double needed, const Collider& collider)
{
    // Number of voxels of the shell around the bounding box.
    const Eigen::Array3d size = shape->bounds().sizes().array() / shape->voxel();
    const double band = needed / shape->voxel();
    const double voxels = (size + 2 * band).prod() - (size - 2 * band).max(0).prod();
    const double most = band > size.maxCoeff() ? max_voxels_of_wide_band : max_voxels;
    if (voxels > most)
        throw Error(fmt::format("points with a radius of {:.4g} m need a band of {:.0f} voxels of {:g} m around its "
                                "level set, about {:.1e} voxels; at most {:.1e} are possible: give it a larger voxel",
                                needed - 2 * shape->voxel(), band, shape->voxel(), voxels, most))
            .in_node(collider.node)
            .at(collider.location);
    return shape->with_band(needed);
}

void warn_of_jump(const Collider& collider, const Jump& jump, double frame, const Evaluation& now)
{
    const auto number = static_cast<std::int64_t>(std::ceil(frame));
    now.warnings.push_back(
        fmt::format("{}:{}: node \"{}\": the shape {}; it sweeps no points along on the way (to confirm, give cut = "
                    "{{{}}}; if it is not a jump, cut = {{}})",
                    collider.location.file, collider.location.line, collider.node, describe(jump, number), number));
}

// Drag from the points' attributes, regardless of the node that set them: targetv and airresist, named as in Houdini.
//
//   a = -airresist (v - targetv)        exact at any step
class AirResistance : public Force {
public:
    AirResistance(PerPoint<float> rate, PerPoint<Vec3f> velocity)
        : rate_(std::move(rate)), velocity_(std::move(velocity))
    {
    }

    std::optional<Uniform> uniform() const override
    {
        if (!rate_.attribute.empty() || !velocity_.attribute.empty()) return std::nullopt;
        Uniform drag;
        drag.linear.k = rate_.constant;
        drag.linear.ku = drag.linear.k * velocity_.constant.cast<double>();
        return drag;
    }

    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        const Strided<float> k = chunk.read(rate_);
        const Strided<Vec3f> u = chunk.read(velocity_);
        for (std::size_t i = 0; i < chunk.size(); ++i) forces.add_drag(i, k[i], u[i].cast<double>());
    }

private:
    PerPoint<float> rate_;
    PerPoint<Vec3f> velocity_;
};

// A value shared by all points becomes a constant.
template <class T>
PerPoint<T> parameter_of(const PointSet& points, const char* name)
{
    const Column<T>* column = points.find<T>(name);
    if (!column) return {};
    return column->is_uniform() ? PerPoint<T>((*column)[0]) : PerPoint<T>::of(name);
}

// Does nothing if no point has an airresist above 0.
void add_air_resistance(Flow& flow, const Evaluation& now)
{
    PerPoint<float> rate = parameter_of<float>(flow.points, "airresist");
    if (rate.attribute.empty() && rate.constant == 0) return;
    flow.dynamics.add(dynamic_of<AirResistance>(now, "", std::move(rate), parameter_of<Vec3f>(flow.points, "targetv")));
}

// A force that is the same for all points at all times.
class MeanAcceleration : public Force {
public:
    MeanAcceleration(const Force& force, const Vec3d& a) : Force(force), a_(a) {}
    void contribute(const Chunk&, Forces& forces) const override { forces.add_uniform(a_); }
    std::optional<Uniform> uniform() const override { return Uniform{a_}; }

private:
    Vec3d a_;
};

// Applies the interaction at the ends of substeps.
class TimedInteraction : public Interaction {
public:
    TimedInteraction(std::vector<std::shared_ptr<const Interaction>> interactions, double begin, double h)
        : Interaction(*interactions.front()), interactions_(std::move(interactions)), begin_(begin), h_(h)
    {
    }
    const Interaction& at(double time) const override
    {
        const auto last = static_cast<double>(interactions_.size() - 1);
        const double k = std::clamp(std::round((time - begin_) / h_ * last), 0.0, last);
        return *interactions_[static_cast<std::size_t>(k)];
    }

private:
    std::vector<std::shared_ptr<const Interaction>> interactions_;
    double begin_, h_;  // s
};

// Adds a changing force to a chain. intervals: twice the substeps, so that their middles are among its times.
class Times {
public:
    Times(const SolveOptions& options, int intervals, bool finer, bool has_births)
        : options_(options), intervals_(intervals), finer_(finer), has_births_(has_births)
    {
    }

    void add(const ChangingForce& force, Dynamics& to) const
    {
        std::vector<std::shared_ptr<const Force>> forces(static_cast<std::size_t>(intervals_) + 1);
        for (int k = 1; k < intervals_; k += has_births_ ? 1 : 2) forces[static_cast<std::size_t>(k)] = at(force, k);
        // The ends are no middles, and even times are unused if all points take the same substeps.
        for (std::size_t k = 0; k < forces.size(); ++k)
            if (!forces[k]) forces[k] = forces[k + 1 < forces.size() ? k + 1 : k - 1];
        const Vec3d mean = mean_of(forces);
        if (!mean.isZero(0)) to.add(std::make_shared<MeanAcceleration>(force, mean));
        to.add(std::make_shared<TimedForce>(std::move(forces), begin(), options_.h, mean));
    }

    void add(const ChangingInteraction& interaction, Dynamics& to) const
    {
        std::vector<std::shared_ptr<const Interaction>> interactions;
        for (int k = 0; k <= intervals_; k += 2)
            interactions.push_back(interaction.at_part(static_cast<double>(k) / intervals_, finer_));
        to.add(std::make_shared<TimedInteraction>(std::move(interactions), begin(), options_.h));
    }

private:
    double begin() const { return options_.time - options_.h; }

    std::shared_ptr<const Force> at(const ChangingForce& force, int k) const
    {
        return force.at(static_cast<double>(k) / intervals_, finer_);
    }

    // Returns the uniform part of a force, or 0 if it is not uniform. Piles need it to find the up direction.
    static Vec3d mean_of(const std::vector<std::shared_ptr<const Force>>& forces)
    {
        Vec3d sum = Vec3d::Zero();
        for (const auto& force : forces) {
            const std::optional<Uniform> uniform = force->uniform();
            if (!uniform || !force->group.empty()) return Vec3d::Zero();
            sum += uniform->a;
        }
        return sum.allFinite() ? Vec3d(sum / static_cast<double>(forces.size())) : Vec3d(Vec3d::Zero());
    }

    const SolveOptions& options_;
    int intervals_;
    bool finer_, has_births_;
};

// Returns a constraint with positions that are functions of time; null if it has none.
std::shared_ptr<const Constraint> through_step(const ChangingConstraint& changing, bool finer)
{
    const std::shared_ptr<const Constraint> end = changing.at(1, finer);
    const auto* placed = dynamic_cast<const Placed*>(end.get());
    if (!placed) return nullptr;
    Placed::AtParts at;
    for (std::size_t k = 0; k < at.size(); ++k) at[k] = changing.at(Placed::parts[k], finer);
    return placed->through(at);
}

Dynamics with(const Dynamics& dynamics, const Times& times, bool finer)
{
    Dynamics result;
    dynamics.visit_in_order([&]<class D>(const std::shared_ptr<const D>& dynamic) {
        if constexpr (std::is_same_v<D, Force>) {
            if (const auto* changing = dynamic_cast<const ChangingForce*>(dynamic.get()))
                return times.add(*changing, result);
        } else if constexpr (std::is_same_v<D, Interaction>) {
            if (const auto* changing = dynamic_cast<const ChangingInteraction*>(dynamic.get()))
                return times.add(*changing, result);
        } else if constexpr (std::is_same_v<D, Constraint>) {
            if (const auto* changing = dynamic_cast<const ChangingConstraint*>(dynamic.get())) {
                if (auto placed = through_step(*changing, finer)) return result.add(std::move(placed));
                if (finer) return result.add(changing->at(0.5, true));
            }
        }
        result.add(dynamic);
    });
    return result;
}

template <class Changing, class D>
bool any_of(const Dynamics::List<D>& list)
{
    return std::any_of(list.begin(), list.end(),
                       [](const auto& dynamic) { return dynamic_cast<const Changing*>(dynamic.get()) != nullptr; });
}

// Assigns the dynamics of the run and of shadows. changing: the colliders before they were set in motion; null for
// those that do not change.
void resolve(Step& step, const Dynamics::List<ChangingCollider>& changing)
{
    const Dynamics& dynamics = step.flow.dynamics;
    if (!any_of<ChangingForce>(dynamics.forces()) && !any_of<ChangingInteraction>(dynamics.interactions()) &&
        !any_of<ChangingConstraint>(dynamics.constraints()) && !any_of<ChangingCollider>(changing)) {
        step.run = step.finer = dynamics;
        return;
    }
    int substeps = step.options.substeps;
    while (step.tolerance && substeps < step.max_substeps) substeps *= 2;
    // Middles of coarser runs lie between those of finer ones if there is a tolerance.
    const bool at_all = step.tolerance || step.flow.points.has("dt");
    step.run = with(dynamics, Times(step.options, 2 * substeps, false, at_all), false);
    if (!step.estimates_errors()) return;
    step.finer = with(dynamics, Times(step.options, 4 * substeps, true, at_all), true);
    for (std::size_t i = 0; i < changing.size(); ++i) {
        if (!changing[i]) continue;
        const std::shared_ptr<const Collider> middle = changing[i]->at(0.5, true);
        auto moving = std::make_shared<Collider>(*dynamics.colliders()[i]);
        moving->bounce = middle->bounce;
        moving->friction = middle->friction;
        moving->radius = middle->radius;
        step.finer.replace_collider(i, std::move(moving));
    }
}

}  // namespace

// Computes the distance from the surface within which a level set is sampled (§4.3).
struct NeededBand {
    const Dynamics& dynamics;
    const PointSet& points;
    double h;  // s
    int substeps;
    std::optional<CollisionRadii> radii = {};  // set when one is needed

    // Returns the band, m: the largest radius plus two voxels, for the cells at its edge, plus the penetration of a
    // substep if points are moved out only after it.
    template <class Body>
    double of(const Collider& collider, const Body& body)
    {
        if (!radii) radii.emplace(dynamics, points);
        const Strided<float> radius = radii->of(collider);
        float largest = 0, fastest2 = 0;
        for (std::size_t i = 0; i < (radius.stride ? points.size() : 1); ++i) largest = std::max(largest, radius[i]);
        // A grid stores its half width in single precision.
        const double needed = (largest + 2 * body.voxel()) * (1 - 0x1p-20);
        if (collider.method == Method::Continuous) return needed;
        const Strided<Vec3f> v = points.v().read();
        for (std::size_t i = 0; i < points.size(); ++i) fastest2 = std::max(fastest2, v[i].squaredNorm());
        // Grows by factors of two, so that accelerating points do not cause a rebuild in every frame.
        const double path = std::sqrt(fastest2) * h / substeps;
        double deep = body.voxel();
        while (deep < path) deep *= 2;
        return needed + std::min(deep, 0.5 * body.bounds().sizes().minCoeff());
    }
};

void ColliderShapes::prepare(Dynamics& dynamics, const PointSet& points, const FrameClock& clock, int substeps,
                             const Evaluation& now)
{
    NeededBand needed_band{dynamics, points, now.frame.dt, substeps};
    widen(dynamics, needed_band, now);
    set_in_motion(dynamics, needed_band, clock, now);
}

void ColliderShapes::widen(Dynamics& dynamics, NeededBand& needed_band, const Evaluation& now)
{
    std::map<ShapePtr, Widened> widened;
    std::map<std::string, Band> bands;
    for (std::size_t i = 0; i < dynamics.colliders().size(); ++i) {
        const std::shared_ptr<const Collider> collider = dynamics.colliders()[i];
        if (const auto blended = std::dynamic_pointer_cast<const BlendedLevelSets>(collider->shape)) {
            const double needed = needed_band.of(*collider, *blended);
            const Stopwatch stopwatch;
            auto replacement = std::make_shared<Collider>(*collider);
            const auto wide = blended->with_band(needed);
            now.figures.bands.push_back({collider->node, wide->band(), wide->active_voxels(), stopwatch.seconds()});
            replacement->shape = wide;
            dynamics.replace_collider(i, std::move(replacement));
            continue;
        }
        const auto level_set = std::dynamic_pointer_cast<const LevelSet>(collider->shape);
        if (!level_set) continue;
        const double needed = needed_band.of(*collider, *level_set);
        const Stopwatch stopwatch;
        Widened made = known(*collider, level_set);
        if (const auto other = widened.find(collider->shape);
            other != widened.end() && other->second.shape->band() >= needed)
            made = other->second;
        const bool builds = made.shape->band() < needed;
        if (builds) made = {widened_to(made.shape, needed, *collider), needed};
        const LevelSetPtr shape = made.shape;
        widened[collider->shape] = made;
        now.figures.bands.push_back(
            {collider->node, shape->band(), shape->active_voxels(), builds ? stopwatch.seconds() : 0});
        if (shape == level_set) continue;
        bands[collider->node] = {made.band, level_set->voxel(), level_set->bounds().min(), level_set->bounds().max(),
                                 level_set->active_voxels()};
        auto replacement = std::make_shared<Collider>(*collider);
        replacement->shape = shape;
        dynamics.replace_collider(i, std::move(replacement));
    }
    widened_ = std::move(widened);
    bands_ = std::move(bands);
    restored_.clear();
}

bool ColliderShapes::Band::is_of(const LevelSet& shape) const
{
    return voxel == shape.voxel() && min == shape.bounds().min() && max == shape.bounds().max() &&
           voxels == shape.active_voxels();
}

// Returns the shape that the previous step left.
ColliderShapes::Widened ColliderShapes::known(const Collider& collider, const LevelSetPtr& shape) const
{
    if (const auto found = widened_.find(collider.shape); found != widened_.end()) return found->second;
    const auto found = restored_.find(collider.node);
    if (found == restored_.end() || !found->second.is_of(*shape)) return {shape, 0};
    return {widened_to(shape, found->second.band, collider), found->second.band};
}

void ColliderShapes::set_in_motion(Dynamics& dynamics, NeededBand& needed_band, const FrameClock& clock,
                                   const Evaluation& now)
{
    const std::int64_t step = clock.step_at(now.frame);
    const double to = now.frame.number, from = clock.at_step(step - 1).number;
    std::map<std::string, Deformation> deformations;
    const auto deformed = [&](const Collider& collider, const PathOptions& options,
                              std::optional<Jump>& jump) -> ShapePtr {
        const auto known = deformations_.find(collider.node);
        const bool same = known != deformations_.end() && known->second.is_of(collider.deforming);
        Deformation& body =
            deformations.emplace(collider.node, same ? known->second : Deformation(collider.deforming)).first->second;
        body.set_body(collider.deforming);
        const double band = needed_band.of(collider, *collider.deforming);
        const Stopwatch stopwatch;
        Deformation::Interval interval = body.over({clock.fps, clock.start}, from, to, collider.motion, options, band);
        const LevelSet& built = *body.at_end();
        now.figures.bands.push_back({collider.node, built.band(), built.active_voxels(), stopwatch.seconds()});
        jump = interval.jump;
        return interval.shape;
    };

    for (std::size_t i = 0; i < dynamics.colliders().size(); ++i) {
        const std::shared_ptr<const Collider> collider = dynamics.colliders()[i];
        if (!collider->motion && !collider->deforming) continue;
        auto in_motion = std::make_shared<Collider>(*collider);
        PathOptions options;
        options.cuts = collider->cuts;
        std::optional<Jump> jump;
        try {
            if (collider->deforming) {
                in_motion->shape = deformed(*collider, options, jump);
            } else {
                const AnimatedShape body(collider->shape, collider->motion);
                MovingStep moved = moving_in_step(body, clock, step, options);
                in_motion->shape = std::move(moved.shape);
                jump = moved.jump;
            }
        } catch (Error& error) {
            error.in_node(collider->node).at(collider->location);
            throw;
        }
        if (jump) warn_of_jump(*collider, *jump, to, now);
        in_motion->motion = nullptr;
        in_motion->deforming = nullptr;
        dynamics.replace_collider(i, std::move(in_motion));
    }
    deformations_ = std::move(deformations);
}

void prepare(Step& step, ColliderShapes& shapes)
{
    Flow& flow = step.flow;
    add_air_resistance(flow, step.now);
    require_in_range(step);
    Dynamics::List<ChangingCollider> changing;
    for (const auto& collider : flow.dynamics.colliders())
        changing.push_back(std::dynamic_pointer_cast<const ChangingCollider>(collider));
    shapes.prepare(flow.dynamics, flow.points, flow.simulation->clock(), step.tolerance ? 1 : step.options.substeps,
                   step.now);
    if (step.is_coupled() && !flow.points.has("still")) flow.points.add({"still", 0.0f});
    if (StuckColumns::are_needed(flow.dynamics)) StuckColumns::add_to(flow.points);
    if (step.tolerance && step.is_coupled())
        throw Error("a tolerance needs independent points, but there are constraints; give substeps instead");
    if (!flow.simulation->trial) resolve(step, changing);
}

void require_in_range(const Step& step)
{
    const PointSet& points = step.flow.points;
    step.flow.dynamics.visit_in_order([&](const auto& dynamic) {
        at_node(*dynamic, [&] {
            for (const AttributeRange& range : dynamic->ranges)
                require_in_range(points, members_of(points, dynamic->group), range, step.options.frame);
        });
    });
    for (const AttributeRange& range : step.now.ranges)
        require_in_range(points, members_of(points, {}), range, step.options.frame);
}

}  // namespace rapid
