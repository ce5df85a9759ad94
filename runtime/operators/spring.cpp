// spring: a damped spring to a position, to a position of each point's own, or to the surface of a shape.
//
//   F = -stiffness (P - target) - damping v        accelerates a point by its mass; both parts are exact at any step
//
// The nearest position on a shape is found at the middle of the step: of second order in its change.
#include "runtime/graph/node.h"

namespace rapid {
namespace {

struct SpringTarget {
    static constexpr std::string_view param_type = "vec3, attribute or shape";

    PerPoint<Vec3f> position;
    ShapePtr shape;
};

void read_value(const Param& param, const Value& value, SpringTarget& target)
{
    target = {};
    if (auto shape = value.object<Shape>())
        target.shape = std::move(shape);
    else
        rapid::read_value(param, value, target.position);
}

struct Spring {
    SpringTarget target;
    PerPoint<float> stiffness, damping;
    std::string group;

    static NodeType declare()
    {
        return node<Spring>("spring", "Holds points with a spring to a place or to a shape.")
            .takes("mass")
            .param(&Spring::target, "target", Vec3d(0, 0, 0), any_number(), "m",
                   "a place, rapid.attr \"NAME\" for each point's own, or a shape")
            .param(&Spring::stiffness, "stiffness", 1.0, at_least(0), "N/m", "force a metre")
            .param(&Spring::damping, "damping", 0.0, at_least(0), "N s/m", "force by speed");
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        std::vector<Vec3d> rest(chunk.size());
        if (target.shape) {
            std::vector<double> phi(chunk.size());
            target.shape->distance(chunk.P, phi, rest);
            for (std::size_t i = 0; i < chunk.size(); ++i) {
                const double slope2 = rest[i].squaredNorm();
                rest[i] = chunk.P[i] - (slope2 > 0 ? Vec3d(phi[i] / slope2 * rest[i]) : Vec3d(Vec3d::Zero()));
            }
        } else {
            const Strided<Vec3f> own = chunk.read(target.position);
            for (std::size_t i = 0; i < chunk.size(); ++i) rest[i] = own[i].cast<double>();
        }
        const Strided<float> k = chunk.read(stiffness), d = chunk.read(damping);
        const Strided<float> mass = masses_of(chunk.points);
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            const double m = mass[chunk.first + i];
            forces.add_spring(i, k[i] / m, rest[i]);
            forces.add_drag(i, d[i] / m, Vec3d::Zero());
        }
    }

    bool add_potential(const Chunk& chunk, std::span<double> energy) const
    {
        if (target.shape) return false;
        const Strided<Vec3f> rest = chunk.read(target.position);
        const Strided<float> k = chunk.read(stiffness), d = chunk.read(damping);
        const Strided<float> mass = masses_of(chunk.points);
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            if (d[i] > 0) return false;
            energy[i] += 0.5 * k[i] / mass[chunk.first + i] * (chunk.P[i] - rest[i].cast<double>()).squaredNorm();
        }
        return true;
    }
};
RAPID_NODE(Spring);

}  // namespace
}  // namespace rapid
