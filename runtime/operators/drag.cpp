// drag: the resistance of still air.
//
//   a = -linear v - quadratic |v| v
//
// Exact at any step, without or along an acceleration; of second order across one. It never reverses a velocity, and
// reproduces the terminal speed.
#include "runtime/graph/node.h"

namespace rapid {
namespace {

struct Drag {
    PerPoint<float> linear, quadratic;
    std::string group;

    static NodeType declare()
    {
        return node<Drag>("drag", "Slows points down by the resistance of still air.")
            .param(&Drag::linear, "linear", 0.0, at_least(0), "1/s",
                   "rate of the drag that is proportional to the speed")
            .param(&Drag::quadratic, "quadratic", 0.0, at_least(0), "1/m",
                   "coefficient of the drag that is proportional to the square of the speed");
    }

    std::optional<Uniform> uniform() const
    {
        if (!linear.attribute.empty() || !quadratic.attribute.empty()) return std::nullopt;
        Uniform drag;
        drag.linear.k = linear.constant;
        drag.linear.c = quadratic.constant;
        return drag;
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        const Strided<float> k = chunk.read(linear), c = chunk.read(quadratic);
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            forces.add_drag(i, k[i], Vec3d::Zero());
            forces.add_quadratic_drag(i, c[i]);
        }
    }
};
RAPID_NODE(Drag);

}  // namespace
}  // namespace rapid
