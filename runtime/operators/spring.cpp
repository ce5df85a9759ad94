// spring: a damped spring to a position, to an individual position per point, or to the surface of a shape.
//
//   F = -stiffness (P - target) - damping v        accelerates a point by its mass; both parts are exact at any step
//
// The target on a shape is the nearest position, even while the point and the shape move: exact on planes at rest, of
// second order on curved surfaces. At any step, only a moving shape can add energy (solver/surface_springs.h).
#include "runtime/graph/node.h"
#include "runtime/graph/step_shape.h"
#include "runtime/shapes/motion/mesh_surface.h"

namespace rapid {
namespace {

struct SpringTarget {
    static constexpr std::string_view param_type = "vec3, attribute or shape at rest or moving";

    PerPoint<Vec3f> position;
    AnyShape shape;
};

void read_value(const Param& param, const Value& value, SpringTarget& target)
{
    target = {};
    if (value.object<Shape>())
        read_value(param, value, target.shape);
    else
        rapid::read_value(param, value, target.position);
}

struct Spring {
    SpringTarget target;
    PerPoint<float> stiffness, damping;
    std::string group;

    static NodeType declare()
    {
        return node<Spring>("spring", "Pulls points to a position or a shape with a spring.")
            .takes("mass")
            .param(&Spring::target, "target", Vec3d(0, 0, 0), any_number(), "m",
                   "position, rapid.attr, or shape to which the spring pulls")
            .param(&Spring::stiffness, "stiffness", 1.0, at_least(0), "N/m", "force per metre of distance")
            .param(&Spring::damping, "damping", 0.0, at_least(0), "N s/m", "force per unit of speed");
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        const Strided<Vec3f> place = chunk.read(target.position);
        const Strided<float> k = chunk.read(stiffness), d = chunk.read(damping);
        const Strided<float> mass = masses_of(chunk.points);
        const StepShape* step = target.shape.step.get();
        const Shape* shape = step ? &step->shape() : target.shape.shape.get();
        const bool is_two_sided = step && is_mesh_surface(*shape);
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            const double m = mass[chunk.first + i];
            const double begin = step ? chunk.time[i] - 0.5 * chunk.dt[i] - step->begin() : 0;
            if (shape)
                forces.add_surface_spring(i, {k[i] / m, shape, begin, is_two_sided});
            else
                forces.add_spring(i, k[i] / m, place[i].cast<double>());
            forces.add_drag(i, d[i] / m, Vec3d::Zero());
        }
    }

    bool add_potential(const Chunk& chunk, std::span<double> energy) const
    {
        if (target.shape.step) return false;
        const Strided<Vec3f> place = chunk.read(target.position);
        const Strided<float> k = chunk.read(stiffness), d = chunk.read(damping);
        std::vector<double> phi(target.shape ? chunk.size() : 0);
        std::vector<Vec3d> gradient(phi.size());
        if (target.shape) target.shape.distance(chunk, phi, gradient);
        const Strided<float> mass = masses_of(chunk.points);
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            if (d[i] > 0) return false;
            const double far2 = !target.shape           ? (chunk.P[i] - place[i].cast<double>()).squaredNorm()
                                : gradient[i].isZero(0) ? 0.0
                                                        : phi[i] * phi[i] / gradient[i].squaredNorm();
            energy[i] += 0.5 * k[i] / mass[chunk.first + i] * far2;
        }
        return true;
    }
};
RAPID_NODE(Spring);

}  // namespace
}  // namespace rapid
