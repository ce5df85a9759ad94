// delete: removes the points of a group for which `where` is true; either may be omitted.
#include "runtime/graph/point_edit.h"

namespace rapid {
namespace {

class DeletePass : public EditPass {
public:
    DeletePass(const Evaluation& evaluation, Selection selection)
        : EditPass(evaluation), selection_(std::move(selection))
    {
    }

    void begin() override { selection_.begin(); }
    std::size_t chunk() const override { return selection_.chunk(); }
    bool is_script() const override { return selection_.is_script(); }
    void visit(const Stretch& stretch) override { stretch.remove(selection_.of(stretch)); }

private:
    Selection selection_;
};

struct Delete {
    std::string group;
    std::shared_ptr<const PointFunction> where;

    static NodeType declare()
    {
        return node<Delete>("delete", "Removes the points of a group, or those for which `where` is true.")
            .param(&Delete::where, "where", Value(), any_number(), "",
                   "function of a point that returns true for points to remove")
            .constant();
    }

    static std::unique_ptr<Operator> make() { return std::make_unique<PointEditOf<Delete>>(); }

    void uses(Uses& uses) const
    {
        if (where) where->uses(uses);
    }

    void check() const
    {
        if (group.empty() && !where) throw Error("no points are selected; give group, where or both");
    }

    bool removes_points() const { return true; }
    bool reads_indices() const { return where && where->reads_indices(); }

    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const
    {
        return std::make_unique<DeletePass>(now, Selection(points, group, where.get(), now, before));
    }
};
RAPID_NODE(Delete);

}  // namespace
}  // namespace rapid
