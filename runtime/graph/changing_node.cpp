#include "runtime/graph/changing_node.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "runtime/at_node.h"
#include "runtime/graph/arguments.h"
#include "runtime/solver/changing.h"
#include "runtime/solver/placed_constraint.h"

namespace rapid {
namespace {

template <class D>
const Dynamics::List<D>& list_of(const Dynamics& dynamics)
{
    if constexpr (std::is_same_v<D, Force>)
        return dynamics.forces();
    else if constexpr (std::is_same_v<D, Interaction>)
        return dynamics.interactions();
    else if constexpr (std::is_same_v<D, Constraint>)
        return dynamics.constraints();
    else if constexpr (std::is_same_v<D, Collider>)
        return dynamics.colliders();
    else
        return dynamics.actions();
}

bool is_followed(const Node& node, const Param& param)
{
    return ChangingNode::between_calls(node, param) != ChangingNode::Between::Unfollowed;
}

}  // namespace

// Of forces all parameters are followed, of constraints and colliders numbers, and the places of constraints. Actions
// are the script's.
ChangingNode::Between ChangingNode::between_calls(const Node& node, const Param& param)
{
    const auto has = [&](Stage stage) {
        return std::count(node.type->stages.begin(), node.type->stages.end(), stage) > 0;
    };
    if (node.type->kind != NodeKind::Dynamic || param.type == "integer") return Between::Unfollowed;
    if (has(Stage::Forces) || (has(Stage::Constraints) && param.type == place_type)) return Between::Interpolated;
    const bool is_number = param.type == "number" && (has(Stage::Collision) || has(Stage::Constraints));
    return is_number ? Between::Held : Between::Unfollowed;
}

ChangingNode::ChangingNode(const PlannedNode& planned, std::shared_ptr<Simulation> simulation)
    : planned_(planned), simulation_(std::move(simulation))
{
    const Node& node = *planned.node;
    for (const std::string& name : functions_of_the_frame(node))
        if (const Param* param = node.type->find(name); is_followed(node, *param))
            curves_.emplace_back(*param, *node.arguments.at(name).function());
}

std::vector<std::string> ChangingNode::not_followed(const Node& node)
{
    std::vector<std::string> names = functions_of_the_frame(node);
    std::erase_if(names, [&](const std::string& name) { return is_followed(node, *node.type->find(name)); });
    return names;
}

void ChangingNode::follow(Dynamics& dynamics, std::size_t before, const Evaluation& now)
{
    if (dynamics.size() != before + 1) return;
    const FrameClock clock = simulation_->clock();
    for (FrameCurve& curve : curves_) curve.move_to(clock.step_at(now.frame), clock);
    if (std::none_of(curves_.begin(), curves_.end(), [](const FrameCurve& curve) { return curve.changes(); })) return;

    Dynamics followed;
    dynamics.visit_in_order([&]<class D>(const std::shared_ptr<const D>& dynamic) {
        if (followed.size() < before) return followed.add(dynamic);
        if constexpr (std::is_same_v<D, Force>)
            followed.add(std::make_shared<ChangingForce>(dynamic, at_part<D>(now)));
        else if constexpr (std::is_same_v<D, Interaction>)
            followed.add(std::make_shared<ChangingInteraction>(*dynamic, at_part<D>(now)));
        else if constexpr (std::is_same_v<D, Constraint>)
            followed.add(std::make_shared<ChangingConstraint>(dynamic, at_part<D>(now)));
        else if constexpr (std::is_same_v<D, Collider>)
            followed.add(std::make_shared<ChangingCollider>(*dynamic, at_part<D>(now)));
        else
            followed.add(dynamic);
    });
    dynamics = std::move(followed);
}

// Solve asks before the node is evaluated again.
template <class D>
AtPart<D> ChangingNode::at_part(const Evaluation& now)
{
    return [this, frame = now.frame, random = now.random, ranges = now.ranges](double part, bool finer) {
        FrameFigures figures;
        std::vector<std::string> warnings;
        const std::function<void(const std::string&, const PointSet&)> write;
        const Node& node = *planned_.node;
        return at<D>(part, finer,
                     {frame, false, node.name, node.location, random, figures, warnings, write, nullptr, ranges});
    };
}

template <class D>
std::shared_ptr<const D> ChangingNode::at(double part, bool finer, const Evaluation& now)
{
    return at_node(now.node, now.location, [&] {
        assign(part, finer);
        std::vector<Flow> inputs(1);
        inputs[0].simulation = simulation_;
        const Flow flow = planned_.op->evaluate(inputs, now);
        assign(1, false);
        return list_of<D>(flow.dynamics).back();
    });
}

void ChangingNode::assign(double part, bool finer)
{
    for (const FrameCurve& curve : curves_)
        curve.param().assign(curve.param(), planned_.op->fields(), curve.at(part, finer));
}

}  // namespace rapid
