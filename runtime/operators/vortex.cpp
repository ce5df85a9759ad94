// vortex: a force around an axis.
//
//   a = strength (axis × r) / |r|        r: from the axis, perpendicular to it; 0 on the axis
#include "runtime/graph/node.h"

namespace rapid {
namespace {

struct Vortex {
    PerPoint<Vec3f> center;
    Vec3d axis;
    PerPoint<float> strength;
    std::string group;

    static NodeType declare()
    {
        return node<Vortex>("vortex", "Accelerates points around an axis.")
            .param(&Vortex::center, "center", Vec3d(0, 0, 0), any_number(), "m", "position on the axis")
            .param(&Vortex::axis, "axis", Vec3d(0, 1, 0), any_number(), "",
                   "direction of the axis, of any nonzero length")
            .param(&Vortex::strength, "strength", 1.0, any_number(), "m/s²",
                   "acceleration, counterclockwise about the axis");
    }

    void check() const
    {
        if (!(axis.norm() > 0)) throw Error("axis = {0, 0, 0} has no direction; its length must be above 0");
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        const Vec3d n = axis.normalized();
        const Strided<Vec3f> at = chunk.read(center);
        const Strided<float> size = chunk.read(strength);
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            const Vec3d around = n.cross(chunk.P[i] - at[i].cast<double>());
            const double length = around.norm();
            if (length > 0) forces.add(i, size[i] / length * around);
        }
    }
};
RAPID_NODE(Vortex);

}  // namespace
}  // namespace rapid
