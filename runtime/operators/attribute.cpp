// attribute: creates attributes, and gives points their default value.
//
// Initial points get the value, as do points born later, or added by a merge, without a value of their own. Existing
// values are never overwritten. With a function of the frame, points get the value of the frame in which they appear.
#include "runtime/graph/point_edit.h"

namespace rapid {
namespace {

struct Attribute {
    std::map<std::string, AttributeValue> values, attributes;

    static NodeType declare()
    {
        return node<Attribute>("attribute",
                               "Gives attributes to points that do not have them and never overwrites values.")
            .param(&Attribute::attributes, "attributes", Value(), any_number(), "",
                   "values by name, for names that are also parameters of nodes: { name = \"\" }")
            .rest(&Attribute::values,
                  "initial value of the attribute: a number, a vec3 {x, y, z}, a quaternion {x, y, z, w} or a string");
    }

    static std::unique_ptr<Operator> make() { return std::make_unique<PointEditOf<Attribute>>(); }

    void uses(Uses& uses) const
    {
        for (const auto* given : {&values, &attributes})
            for (const auto& [name, value] : *given) {
                uses.makes.push_back({name, value});
                uses.defaults.push_back({name, value});
            }
    }

    // Visits no point: existing points have a value, or get it with the column.
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before&) const
    {
        for (const auto* given : {&values, &attributes})
            for (const auto& [name, value] : *given)
                if (now.keeps(name)) points.set_fallback({name, value});
        return nullptr;
    }
};
RAPID_NODE(Attribute);

}  // namespace
}  // namespace rapid
