// A plugin with a node of each sort: a constraint (rail), an action inside Solve (brake), one that edits points
// (paint).
#include "runtime/graph/plugin.h"
#include "runtime/solver/constraints/rows.h"

RAPID_PLUGIN;

using namespace rapid;
namespace {

struct Rail {
    struct OnCylinder {  // C = √(x² + z²) - radius
        static constexpr int points = 1;
        double radius;
        double residual(const std::array<Vec3d, 1>& P, std::array<Vec3d, 1>& gradient) const
        {
            const double r = std::hypot(P[0].x(), P[0].z());
            gradient[0] = r > 0 ? Vec3d(P[0].x() / r, 0, P[0].z() / r) : Vec3d(Vec3d::UnitX());
            return r - radius;
        }
    };
    double radius, compliance;
    std::string group;
    std::shared_ptr<Rows<OnCylinder>> rows = std::make_shared<Rows<OnCylinder>>();  // over a run
    static NodeType declare()
    {
        return node<Rail>("rail", "Keeps points at a distance from the y axis.")
            .stage(Stage::Constraints)
            .param(&Rail::radius, "radius", 1.0, above(0), "m", "distance from the axis")
            .param(&Rail::compliance, "compliance", 0.0, at_least(0), "m/N", "displacement per force; 0 is rigid");
    }
    auto dynamic(const Evaluation& now) const
    {
        return constrain(now, group, [rows = rows, kind = OnCylinder{radius}, c = compliance](const PointSet& points) {
            for (std::size_t i = 0; i < points.size(); ++i)
                if (!rows->has({points.id()[i]})) rows->add({points.id()[i]}, kind, c);
            return rows;
        });
    }
};
RAPID_NODE(Rail);

struct Brake {
    double most;
    static NodeType declare()
    {
        return node<Brake>("brake", "Limits the speed of points, in every substep.")
            .param(&Brake::most, "most", 1.0, at_least(0), "m/s", "maximum speed");
    }
    auto dynamic(const Evaluation& now) const
    {
        return act(now, [most = most](Vec3d&, Vec3d& v) {
            if (v.norm() > most) v *= most / v.norm();
        });
    }
};
RAPID_NODE(Brake);

}  // namespace
