// wind: the drag of moving air.
//
//   a = -drag (v - velocity)        exact at any step: no drag is too stiff
#include "runtime/graph/node.h"

namespace rapid {
namespace {

struct Wind {
    PerPoint<Vec3f> velocity;
    PerPoint<float> drag;
    std::string group;

    static NodeType declare()
    {
        return node<Wind>("wind", "Drags points along with moving air.")
            .param(&Wind::velocity, "velocity", Vec3d(0, 0, 0), any_number(), "m/s", "velocity of the air")
            .param(&Wind::drag, "drag", 1.0, at_least(0), "1/s", "rate at which points reach the velocity of the air");
    }

    std::optional<Uniform> uniform() const
    {
        if (!velocity.attribute.empty() || !drag.attribute.empty()) return std::nullopt;
        Uniform wind;
        wind.linear.k = drag.constant;
        wind.linear.ku = wind.linear.k * velocity.constant.cast<double>();
        return wind;
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        const Strided<Vec3f> u = chunk.read(velocity);
        const Strided<float> k = chunk.read(drag);
        for (std::size_t i = 0; i < chunk.size(); ++i) forces.add_drag(i, k[i], u[i].cast<double>());
    }
};
RAPID_NODE(Wind);

}  // namespace
}  // namespace rapid
