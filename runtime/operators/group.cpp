// group: says anew, at each frame, which points are in a group.
//
// The members are the points for which `where` is true; with `group`, only those that are in that group too. A point
// that no longer qualifies is out.
#include "runtime/graph/selection.h"

namespace rapid {
namespace {

struct Group {
    std::string name, group;
    std::shared_ptr<const PointFunction> where;

    static NodeType declare()
    {
        return node<Group>("group", "Puts the points for which `where` is true into a group, anew at each frame.")
            .param(&Group::name, "name", Value(), any_number(), "", "name of the group that is made")
            .required()
            .constant()
            .param(&Group::where, "where", Value(), any_number(), "",
                   "says of a point whether it is in the group; without it all points are")
            .constant();
    }

    void uses(Uses& uses) const
    {
        uses.makes_groups.push_back(name);
        if (where) where->uses(uses);
    }

    void check() const
    {
        if (name.empty()) throw Error("name = \"\" names no group; give it at least one letter");
    }

    void edit(PointSet& points, const Evaluation& now) const
    {
        if (!now.keeps_group(name)) return;
        if (group.empty() && !where) return points.group(name).fill(1);
        const std::vector<std::uint8_t> members = select(points, group, where.get(), now);
        points.group(name) = Column<std::uint8_t>(std::span<const std::uint8_t>(members));
    }
};
RAPID_NODE(Group);

}  // namespace
}  // namespace rapid
