#include "runtime/graph/changing_node.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "runtime/base/at_node.h"
#include "runtime/base/in_motion.h"
#include "runtime/graph/arguments.h"
#include "runtime/graph/step_shape.h"
#include "runtime/solver/changing.h"

namespace rapid {
namespace {

constexpr int max_values = 5;  // values at steps: four give the value and all five its error
constexpr std::size_t max_used = 4;
constexpr std::size_t max_coordinates = 3 * 4096;

// Adds the numbers of a value, including nested lists. Returns false if it contains anything else.
bool add_numbers(const Value& value, std::vector<double>& numbers)
{
    if (const double* number = value.get<double>()) {
        numbers.push_back(*number);
    } else if (const Vec3d* v = value.get<Vec3d>()) {
        numbers.insert(numbers.end(), v->data(), v->data() + 3);
    } else if (const Table* table = value.table(); table && table->named.empty() && table->numbered.empty()) {
        for (const Value& entry : table->list)
            if (numbers.size() >= max_coordinates || !add_numbers(entry, numbers)) return false;
    } else {
        return false;
    }
    return true;
}

// Returns the numbers of a value; empty if it contains anything else, or none.
std::vector<double> numbers_of(const Value& value)
{
    std::vector<double> numbers;
    const auto is_finite = [](double x) { return std::isfinite(x); };
    if (!add_numbers(value, numbers) || !std::all_of(numbers.begin(), numbers.end(), is_finite)) return {};
    return numbers;
}

// Compares values that are not numbers. The state of a moving object equals any value, because its user follows the
// object through the step.
bool same(const Value& a, const Value& b)
{
    if (in_motion(b.object<Object>())) return true;
    const AttributeRef *attribute = a.get<AttributeRef>(), *other = b.get<AttributeRef>();
    if (attribute && other) return attribute->name == other->name;
    const ObjectPtr *object = a.get<ObjectPtr>(), *another = b.get<ObjectPtr>();
    return object && another && *object == *another;
}

// Returns numbers, from `next` on, in the form of another value.
Value in_form_of(const Value& value, const std::vector<double>& numbers, std::size_t& next)
{
    if (value.get<double>()) return numbers[next++];
    if (value.get<Vec3d>()) {
        const Vec3d v(numbers[next], numbers[next + 1], numbers[next + 2]);
        next += 3;
        return v;
    }
    auto table = std::make_shared<Table>();
    for (const Value& entry : value.table()->list) table->list.push_back(in_form_of(entry, numbers, next));
    return std::shared_ptr<const Table>(std::move(table));
}

}  // namespace

double interpolated(std::span<const double> values, int first, std::size_t used, double x)
{
    const auto count = static_cast<int>(values.size());
    const int nodes = std::min(static_cast<int>(used), count);
    const int from = std::clamp(-first + 1 - nodes / 2, 0, count - nodes);
    double sum = 0;
    for (int i = from; i < from + nodes; ++i) {
        double weight = 1;
        for (int k = from; k < from + nodes; ++k)
            if (k != i) weight *= (x - (first + k)) / (i - k);
        sum += weight * values[static_cast<std::size_t>(i)];
    }
    return sum;
}

bool jumps(std::span<const double> values)
{
    std::vector<double> differences(values.begin(), values.end());
    double steepest = 0;
    for (std::size_t order = 1; order < values.size(); ++order) {
        for (std::size_t i = 0; i + order < values.size(); ++i) differences[i] = differences[i + 1] - differences[i];
        for (std::size_t i = 0; order == 1 && i + 1 < values.size(); ++i)
            steepest = std::max(steepest, std::abs(differences[i]));
    }
    return std::abs(differences[0]) > 0.5 * steepest;
}

void FrameCurve::move_to(std::int64_t step, const FrameClock& clock)
{
    const auto value_at = [&](std::int64_t at) -> const Value& {
        const auto found = known_.find(at);
        return found != known_.end() ? found->second
                                     : known_.emplace(at, function_.call(clock.at_step(at))).first->second;
    };
    changes_ = false;
    values_.clear();
    begin_ = step > clock.start ? value_at(step - 1) : value_at(step);
    end_ = value_at(step);
    const std::size_t coordinates = numbers_of(end_).size();
    const std::int64_t first = std::max(clock.start, step - max_values + 2);
    known_.erase(known_.begin(), known_.lower_bound(first));
    if (step <= clock.start) return;
    if (coordinates == 0) {
        changes_ = !same(begin_, end_);
        known_.erase(known_.begin(), known_.lower_bound(step));
        if (changes_) begin_ = in_step(param_, begin_, clock, clock.at_step(step - 1));
        end_ = in_step(param_, end_, clock, clock.at_step(step));
        return;
    }

    // Collects numbers backward from the end of the step as far as they exist, then forward.
    std::vector<std::vector<double>> before, after;
    const auto add = [&](std::int64_t at, auto& list) {
        std::vector<double> numbers;
        try {
            numbers = numbers_of(value_at(at));
        } catch (const Error&) {  // called again if it is needed
            if (at < step) throw;
        }
        const bool fits = numbers.size() == coordinates;
        if (fits) list.push_back(std::move(numbers));
        return fits;
    };
    for (std::int64_t at = step; at >= first && add(at, before); --at) {
    }
    if (before.size() < 2) return;
    const std::int64_t last = std::max(step + 1, first + max_values - 1);
    for (std::int64_t at = step + 1; at <= last && add(at, after); ++at) {
    }
    first_ = 2 - static_cast<int>(before.size());
    changes_ = before[0] != before[1];
    std::reverse(before.begin(), before.end());
    before.insert(before.end(), after.begin(), after.end());
    values_.assign(coordinates, {});
    for (const std::vector<double>& numbers : before) {
        for (std::size_t k = 0; k < coordinates; ++k) values_[k].push_back(numbers[k]);
        changes_ |= numbers != before.front();
    }
}

Value FrameCurve::at(double part, bool finer) const
{
    if (!changes_) return end_;
    if (values_.empty()) return finer && part < 0.5 ? begin_ : end_;
    std::vector<double> numbers;
    for (const std::vector<double>& values : values_) {
        const double begin = values[static_cast<std::size_t>(-first_)],
                     end = values[static_cast<std::size_t>(1 - first_)];
        const double line = begin + part * (end - begin);
        const bool is_curve = values.size() > 2 && !jumps(values);
        const std::size_t used = finer ? values.size() : std::min(max_used, values.size() - 1);
        const double curve = is_curve ? interpolated(values, first_, used, part) : finer ? end : line;
        numbers.push_back(param_.range.contains(curve) ? curve : line);
    }
    std::size_t next = 0;
    return in_form_of(end_, numbers, next);
}

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

// For forces, all parameters are interpolated; for constraints and colliders, numbers are held, and the positions of
// constraints interpolated. Actions are left to the script.
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

std::vector<std::string> ChangingNode::ignored_changes(const Node& node)
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

// Solve queries this before the node is evaluated again.
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
