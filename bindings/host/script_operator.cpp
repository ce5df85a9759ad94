#include "bindings/host/script_operator.h"

#include "bindings/host/detail.h"

namespace rapid {
namespace {

// An operator for an action or a function of all points.
class ScriptOperator : public Operator {
public:
    ScriptOperator(NodeKind kind, ScriptFields fields) : kind_(kind), fields_(std::move(fields)) {}

    void* fields() override { return &fields_; }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override
    {
        fields_.add_attributes(inputs[0].points, now);
        if (fields_.kernel->source.of_the_set)
            run_detail(*fields_.kernel, inputs[0], now, fields_.arguments);
        else
            inputs[0].dynamics.add(fields_.kernel->action(fields_.group, now, fields_.arguments));
        return std::move(inputs[0]);
    }
    Flow start(std::span<Flow> inputs, const Evaluation&) override { return std::move(inputs[0]); }
    void uses(Uses& uses) const override
    {
        if (!fields_.group.empty()) uses.reads_groups.push_back(fields_.group);
        if (kind_ == NodeKind::Dynamic)
            fields_.kernel->uses_in_action(uses, fields_.arguments);
        else
            fields_.kernel->uses(uses, fields_.arguments);
    }
    void check() const override {}

private:
    const NodeKind kind_;
    ScriptFields fields_;
};

}  // namespace

std::unique_ptr<Operator> make_script_operator(NodeKind kind, bool edits_points, ScriptFields fields)
{
    if (edits_points) return std::make_unique<PointEditOf<ScriptFields>>(std::move(fields));
    return std::make_unique<ScriptOperator>(kind, std::move(fields));
}

}  // namespace rapid
