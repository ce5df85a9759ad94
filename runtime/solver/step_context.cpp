#include "runtime/solver/step_context.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "runtime/points/members.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/forces.h"

namespace rapid {
namespace {

PointSet& with_needed_columns(PointSet& points, const Dynamics& dynamics)
{
    if (StuckColumns::are_needed(dynamics)) StuckColumns::add_to(points);
    return points;
}

}  // namespace

StepContext::StepContext(PointSet& set, const Dynamics& dynamics, const SolveOptions& solve_options)
    : points(with_needed_columns(set, dynamics)),
      options(solve_options),
      scene(set, dynamics, options.h),
      P(set.P().write()),
      v(set.v().write()),
      dead(scene.actions.empty() && !scene.kills ? 0 : set.size()),
      errors(set, options.frame)
{
    if (scene.records) hits_.emplace(points, options.begins_frame);
    if (StuckColumns::are_needed(dynamics)) stuck_.emplace(points);
    if (!options.group.empty()) members_ = members_of(points, options.group);
    time.h = options.h;
    if (points.has("dt")) time.own = points.column<float>("dt").read();
}

CollisionContext StepContext::collision_context()
{
    return {hits_ ? &*hits_ : nullptr,
            dead,
            options.sinks.met,
            scene.mass,
            options.time,
            options.h,
            options.sinks.log,
            stuck_ ? &*stuck_ : nullptr,
            scene.actions.empty() ? 1 : 2};
}

void StepContext::count(FrameFigures of_chunk, std::size_t first)
{
    const std::scoped_lock lock(mutex_);
    energies_.emplace_back(first, std::exchange(of_chunk.contact_energy, {}));
    figures_.add(of_chunk);
}

void StepContext::remove_dead()
{
    if (std::find(dead.begin(), dead.end(), 1) == dead.end()) return;
    if (options.sinks.log) options.sinks.log->take_dead(points, dead);
    for (std::uint8_t& killed : dead) killed = !killed;
    const std::size_t before = points.size();
    points.keep(dead);
    figures_.died = before - points.size();
}

FrameFigures StepContext::take_figures()
{
    // In the order of the points, because a sum of doubles depends on it.
    std::stable_sort(energies_.begin(), energies_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [first, energy] : energies_) figures_.contact_energy += energy;
    return std::move(figures_);
}

namespace {

// Adds each dynamic to the scene.
class SceneBuilder {
public:
    SceneBuilder(StepScene& scene, const PointSet& points, double h) : scene_(scene), points_(points), h_(h) {}

    void operator()(const std::shared_ptr<const Force>& force) const
    {
        at_node(*force, [&] { add(*force); });
    }
    void operator()(const std::shared_ptr<const Collider>& collider) const
    {
        at_node(*collider, [&] { scene_.obstacles.emplace_back(*collider, points_, scene_.radii->of(*collider)); });
        scene_.kills |= collider->response == Response::Die;
        scene_.records |= collider->record.has_value();
    }
    void operator()(const std::shared_ptr<const Constraint>& constraint) const
    {
        at_node(*constraint, [&] {
            if (auto coupling = constraint->begin(points_, h_))
                scene_.constraints.push_back({constraint.get(), std::move(coupling)});
        });
    }
    void operator()(const std::shared_ptr<const Action>&) const {}       // begun before
    void operator()(const std::shared_ptr<const Interaction>&) const {}  // not part of the step: see interact()

private:
    void add(const Force& force) const
    {
        const std::optional<Uniform> uniform = force.uniform();
        if (uniform && !uniform->a.allFinite())
            throw Error(fmt::format("its acceleration is {{{:g}, {:g}, {:g}}}; it must be finite", uniform->a.x(),
                                    uniform->a.y(), uniform->a.z()));
        if (uniform && force.group.empty()) {
            scene_.uniform.a += uniform->a;
            scene_.uniform.linear.add(uniform->linear);
            return;
        }
        scene_.forces.push_back({&force, uniform, members_of(points_, force.group), force.group.empty()});
    }

    StepScene& scene_;
    const PointSet& points_;
    double h_;
};

}  // namespace

const Column<Vec3f>* nonzero_forces_of(const PointSet& points)
{
    const auto* force = points.find<Vec3f>("force");
    const bool is_zero = force && force->is_uniform() && !points.empty() && (*force)[0].isZero(0);
    return is_zero ? nullptr : force;
}

StepScene::StepScene(PointSet& points, const Dynamics& dynamics, double h) : mass{&unit_mass, 0}
{
    // Actions come first: they make columns writable, and pointers to columns taken afterwards stay valid.
    for (const auto& action : dynamics.actions()) at_node(*action, [&] { action->prepare(points); });
    for (const auto& action : dynamics.actions())
        at_node(*action, [&] {
            if (auto pass = action->begin(points)) actions.push_back({action.get(), std::move(pass)});
        });
    const PointSet& set = points;
    radii.emplace(dynamics, set);
    dynamics.visit_in_order(SceneBuilder(*this, set, h));
    force = nonzero_forces_of(set);
    if (set.has("mass")) mass = set.column<float>("mass").read();
}

bool StepScene::is_ballistic() const { return is_uniform() && actions.empty() && has_closed_form(uniform.linear); }

CollisionRadii::CollisionRadii(const Dynamics& dynamics, const PointSet& points) : points_(&points)
{
    const bool requested = std::any_of(dynamics.colliders().begin(), dynamics.colliders().end(),
                                       [](const auto& collider) { return !collider->radius; });
    for (const auto& constraint : dynamics.constraints()) {
        const std::optional<PerPoint<float>> given = constraint->radius();
        if (!requested || !given) continue;
        at_node(*constraint, [&] {
            const Strided<float> radius = given->read(points);
            const Strided<std::uint8_t> members = members_of(points, constraint->group);
            by_constraint_.resize(points.size());
            for (std::size_t i = 0; i < points.size(); ++i)
                if (members[i]) by_constraint_[i] = std::max(by_constraint_[i], radius[i]);
        });
    }
    if (by_constraint_.empty() || !points.has("pscale")) return;
    const Strided<float> pscale = points.column<float>("pscale").read();
    for (std::size_t i = 0; i < points.size(); ++i)
        if (pscale[i] > 0) by_constraint_[i] = pscale[i];
}

Strided<float> CollisionRadii::of(const Collider& collider) const
{
    if (!collider.radius && !by_constraint_.empty()) return {by_constraint_.data(), 1};
    return radii_of(collider.radius, *points_);
}

}  // namespace rapid
