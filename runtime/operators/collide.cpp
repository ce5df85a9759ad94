// collide: points bounce off a shape, slide on it, and come to rest (paper §4).
//
//   v+ = vt max(0, 1 - μ (1 + ε) |vn| / |vt|) - ε vn        ε = bounce, μ = friction
//
// at the time of impact on the point's path, where its distance from the shape is its radius.
#include "runtime/graph/node.h"

namespace rapid {
namespace {

struct Collide {
    ShapePtr shape;
    PerPoint<float> bounce, friction;
    std::optional<PerPoint<float>> radius;
    std::string group;

    static NodeType declare()
    {
        return node<Collide>("collide", "Keeps points out of a shape: they bounce, slide and come to rest on it.")
            .param(&Collide::shape, "shape", Value(), any_number(), "", "what the points collide with")
            .required()
            .param(&Collide::bounce, "bounce", 0.5, between(0, 1), "",
                   "restitution: the part of the speed that is kept")
            .param(&Collide::friction, "friction", 0.0, at_least(0), "", "Coulomb's coefficient")
            .param(&Collide::radius, "radius", Value(), at_least(0), "m",
                   "of the points; the attribute pscale where they have it, else 0");
    }

    DynamicPtr dynamic(const Evaluation& now) const
    {
        auto collider = std::make_shared<Collider>();
        collider->node = now.node;
        collider->location = now.location;
        collider->group = group;
        collider->shape = shape;
        collider->bounce = bounce;
        collider->friction = friction;
        collider->radius = radius;
        return collider;
    }
};
RAPID_NODE(Collide);

}  // namespace
}  // namespace rapid
