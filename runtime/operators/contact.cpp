// contact: points collide as spheres, with friction and restitution (paper §5.1, §5.2).
//
// Pairs are found in sparse grids of cells, one per cluster of radii: `max_difference` and `max_grids` trade the time
// of many grids against that of wide cells (Algorithm 1; solver/constraints/contact_search.h).
#include "runtime/graph/node.h"
#include "runtime/graph/stateful.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_forces.h"
#include "runtime/solver/constraints/contact_state.h"
#include "runtime/solver/constraints/contacts.h"
#include "runtime/solver/constraints/pile_substeps.h"
#include "runtime/solver/constraints/spin.h"

namespace rapid {
namespace {

// Above this, points born in one another may fly apart: 10 m/s at 5, 2,700 at 8, for 1 and 10 kg in 0.02 m.
constexpr double max_scaling = 4;

class ContactConstraint : public RememberingConstraint<ContactConstraint, Contacts> {
public:
    ContactOptions options;

    std::shared_ptr<Coupling> begin(const PointSet& points, double) const override
    {
        memory->follow(points, options, group);
        return memory;
    }
    std::optional<PerPoint<float>> radius() const override { return options.radius; }
    double needed_substeps(const PointSet& points, const Vec3d& acceleration, double h) const override
    {
        const ContactMaterial material(points, options, group);
        return pile_substeps(points, material.radius, acceleration, h, !(options.mass_scaling > 0));
    }
    bool births_overlap() const override { return memory->births_overlap(); }
};

struct ContactNode {
    std::optional<PerPoint<float>> radius;
    PerPoint<float> bounce, friction;
    std::optional<double> max_difference;
    int max_grids;
    double mass_scaling;
    bool record, spin;
    PerPoint<float> rolling;
    std::string group;

    static NodeType declare()
    {
        return node<ContactNode>("contact", "Makes points collide with each other as spheres: sand, rubble, balls.")
            .stage(Stage::ContactGrid)
            .stage(Stage::Constraints)
            .takes("pscale")
            .takes("mass")
            .param(&ContactNode::radius, "radius", Value(), at_least(0), "m",
                   "radius of the points; the default is the attribute pscale, or 0 without it")
            .param(&ContactNode::bounce, "bounce", 0.0, between(0, 1), "",
                   "restitution between points; a pair uses the larger value of its points")
            .param(&ContactNode::friction, "friction", 0.0, at_least(0), "",
                   "Coulomb coefficient of friction; a pair uses the geometric mean of its points")
            .param(
                &ContactNode::max_difference, "max_difference", Value(), at_least(0), "m",
                "largest difference of radii within one search grid; the default is half of the largest radius in it")
            .param(&ContactNode::max_grids, "max_grids", 8.0, between(1, 254), "",
                   "maximum number of search grids for different radii")
            .param(&ContactNode::mass_scaling, "mass_scaling", 0.0, between(0, max_scaling), "",
                   "makes a point count as e^mass_scaling times lighter than the one below it, so that tall stacks "
                   "hold with few substeps")
            .param(&ContactNode::record, "record", false, any_number(), "",
                   "writes contact forces to normalforce and frictionforce (N, mean over the frame), and their number "
                   "to contactnum")
            .constant()
            .param(&ContactNode::spin, "spin", false, any_number(), "",
                   "lets friction turn the points as solid spheres, with the attributes w (rad/s) and orient")
            .constant()
            .param(&ContactNode::rolling, "rolling", 0.0, at_least(0), "",
                   "coefficient of rolling friction, with spin; a pair uses the geometric mean of its points");
    }

    void check() const
    {
        if (!spin && (!rolling.attribute.empty() || rolling.constant > 0))
            throw Error("rolling is the friction of points that turn; add spin = true");
    }

    void uses(Uses& uses) const
    {
        const auto uses_all = [&](const auto& names) {
            uses.reads.insert(uses.reads.end(), std::begin(names), std::end(names));
            uses.writes.insert(uses.writes.end(), std::begin(names), std::end(names));
        };
        if (record) uses_all(ContactForces::names);
        if (!spin) return;
        uses_all(SpinState::names);
        uses.makes.push_back({"orient", Quatf(Quatf::Identity())});
        uses.makes.push_back({"w", Vec3f(Vec3f::Zero())});
    }

    std::shared_ptr<const Constraint> dynamic(const Evaluation& now) const
    {
        auto constraint = dynamic_of<ContactConstraint>(now, group);
        constraint->memory = contacts_;
        constraint->options = {radius,       bounce, friction, max_difference, max_grids,
                               mass_scaling, record, spin,     rolling};
        return constraint;
    }

    static std::unique_ptr<Operator> make() { return stateful<ContactNode>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(*contacts_);
    }

private:
    std::shared_ptr<Contacts> contacts_ = std::make_shared<Contacts>();
};
RAPID_NODE(ContactNode);

}  // namespace
}  // namespace rapid
