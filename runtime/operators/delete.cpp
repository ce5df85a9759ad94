// delete: removes the points of a group, or those for which `where` is true; with both, those for which both hold.
#include "runtime/graph/selection.h"

#include <algorithm>

namespace rapid {
namespace {

struct Delete {
    std::string group;
    std::shared_ptr<const PointFunction> where;

    static NodeType declare()
    {
        return node<Delete>("delete", "Removes the points of a group, or those for which `where` is true.")
            .param(&Delete::where, "where", Value(), any_number(), "", "says of a point whether it is removed")
            .constant();
    }

    void uses(Uses& uses) const
    {
        if (where) where->uses(uses);
    }

    void check() const
    {
        if (group.empty() && !where) throw Error("nothing says which points to remove; give group, where or both");
    }

    void edit(PointSet& points, const Evaluation& now) const
    {
        std::vector<std::uint8_t> mask = select(points, group, where.get(), now);
        for (std::uint8_t& keep : mask) keep ^= 1;
        const std::size_t before = points.size();
        points.keep(mask);
        now.figures.died += before - points.size();
    }
};
RAPID_NODE(Delete);

}  // namespace
}  // namespace rapid
