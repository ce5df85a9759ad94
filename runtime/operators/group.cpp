// group: determines the members of a group at each frame.
//
// The members are the points for which `where` is true; with `group`, only those that are in that group too. A point
// that no longer qualifies leaves the group.
#include "runtime/graph/point_edit.h"

#include <algorithm>

namespace rapid {
namespace {

class GroupPass : public EditPass {
public:
    GroupPass(const Evaluation& evaluation, Selection selection, Column<std::uint8_t>& members)
        : EditPass(evaluation), selection_(std::move(selection)), members_(members)
    {
        members_.write();
    }

    void begin() override
    {
        selection_.begin();
        written_ = members_.write();
    }
    std::size_t chunk() const override { return selection_.chunk(); }
    bool is_script() const override { return selection_.is_script(); }
    // The group that limits the selection, or that `where` reads, may be the written one: all points of the chunk are
    // selected before any is written.
    void visit(const Stretch& stretch) override
    {
        const std::vector<std::uint8_t> selected = selection_.of(stretch);
        std::copy(selected.begin(), selected.end(), written_.begin() + static_cast<std::ptrdiff_t>(stretch.begin));
    }

private:
    Selection selection_;
    Column<std::uint8_t>& members_;
    std::span<std::uint8_t> written_;
};

struct Group {
    std::string name, group;
    std::shared_ptr<const PointFunction> where;

    static NodeType declare()
    {
        return node<Group>("group", "Puts the points for which `where` is true into a group, in each frame.")
            .param(&Group::name, "name", Value(), any_number(), "", "name of the group")
            .required()
            .constant()
            .param(&Group::where, "where", Value(), any_number(), "",
                   "function of a point that returns true for members; without it all points are members")
            .constant();
    }

    static std::unique_ptr<Operator> make() { return std::make_unique<PointEditOf<Group>>(); }

    void uses(Uses& uses) const
    {
        uses.makes_groups.push_back(name);
        if (where) where->uses(uses);
    }

    void check() const
    {
        if (name.empty()) throw Error("name = \"\" is empty; give the group a name");
    }

    bool reads_indices() const { return where && where->reads_indices(); }

    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const
    {
        if (!now.keeps_group(name)) return nullptr;
        Column<std::uint8_t>& members = points.group(name);
        if (group.empty() && !where && !before.edits) return members.fill(1), nullptr;
        Selection selection(points, group, where.get(), now, before);
        return std::make_unique<GroupPass>(now, std::move(selection), members);
    }
};
RAPID_NODE(Group);

}  // namespace
}  // namespace rapid
