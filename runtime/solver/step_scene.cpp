#include "runtime/solver/step_scene.h"

#include <fmt/format.h>

#include "runtime/points/members.h"
#include "runtime/solver/forces.h"

namespace rapid {
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

}  // namespace rapid
