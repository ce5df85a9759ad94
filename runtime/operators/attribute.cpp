// attribute: brings attributes into being.
//
// Points that have no value yet get the one given here: the initial ones, those born later without one of their own,
// and those that a merge brings without one. Values that are there are never overwritten. A value that is a function of
// the frame is the one that points get at that frame.
#include "runtime/graph/point_edit.h"

namespace rapid {
namespace {

struct Attribute {
    std::map<std::string, AttributeValue> values;

    static NodeType declare()
    {
        return node<Attribute>("attribute", "Gives attributes to points that do not have them; never overwrites.")
            .rest(&Attribute::values, "value of points that have none: a number is a float, {x, y, z} a vec3");
    }

    static std::unique_ptr<Operator> make() { return std::make_unique<PointEditOf<Attribute>>(); }

    void uses(Uses& uses) const
    {
        for (const auto& [name, value] : values) {
            uses.makes.push_back({name, value});
            uses.defaults.push_back({name, value});
        }
    }

    // No point is visited: one that is there has a value, or gets it with the column.
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before&) const
    {
        for (const auto& [name, value] : values)
            if (now.keeps(name)) points.set_fallback({name, value});
        return nullptr;
    }
};
RAPID_NODE(Attribute);

}  // namespace
}  // namespace rapid
