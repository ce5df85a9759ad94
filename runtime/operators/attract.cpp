// attract: a force towards a point, or towards the surface of a shape.
//
//   a = strength d / (|d|² + core²)^((falloff + 1) / 2),   d = center - P        0 at d = 0
//
// A falloff of 2 is the inverse-square law, 0 a constant acceleration; a negative strength repels.
#include <fmt/format.h>

#include <cmath>

#include "runtime/graph/node.h"
#include "runtime/graph/step_shape.h"

namespace rapid {
namespace {

struct Attract {
    PerPoint<Vec3f> center;
    AnyShape shape;
    PerPoint<float> strength;
    double falloff, core;
    std::string group;

    static NodeType declare()
    {
        return node<Attract>("attract", "Attracts points to a position or to the surface of a shape.")
            .param(&Attract::center, "center", Vec3d(0, 0, 0), any_number(), "m", "position that attracts the points")
            .param(&Attract::shape, "shape", Value(), any_number(), "",
                   "shape or mesh whose surface attracts the points, instead of center")
            .param(&Attract::strength, "strength", 1.0, any_number(), "m/s²",
                   "acceleration at a distance of 1 m; a negative value repels")
            .param(&Attract::falloff, "falloff", 2.0, any_number(), "",
                   "power of the distance with which the acceleration decreases")
            .param(&Attract::core, "core", 0.0, at_least(0), "m",
                   "distance below which the acceleration stops growing; give one with a shape, whose pull is "
                   "unbounded at 0");
    }

    std::shared_ptr<const Force> dynamic(const Evaluation& now) const
    {
        if (shape && falloff > 0 && core == 0 && (!strength.attribute.empty() || strength.constant > 0))
            now.warnings.push_back(fmt::format("{}:{}: node \"{}\": {}", now.location.file, now.location.line, now.node,
                                               advice(now.frame.dt)));
        return dynamic_of<detail::ForceOf<Attract>>(now, group, *this);
    }

    // Attracted points pass through the surface, where only core bounds the force. Within core it is a spring of
    // omega² = strength / core^(falloff + 1); a quarter of a radian per step is resolved.
    std::string advice(double dt) const
    {
        const std::string text =
            "without core its pull is unbounded at the surface of shape, and no number of substeps resolves it; give "
            "core, the distance below which it stops growing";
        if (!strength.attribute.empty()) return text;
        const double least = std::pow(16 * strength.constant * dt * dt, 1 / (falloff + 1));
        return text + fmt::format(": from {:.2g} m on 1 substep resolves it", least);
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        std::vector<Vec3d> towards(chunk.size());
        if (shape) {
            std::vector<double> phi(chunk.size());
            shape.distance(chunk, phi, towards);
            for (std::size_t i = 0; i < chunk.size(); ++i) {
                const double slope = towards[i].norm();
                if (slope > 0) towards[i] *= -phi[i] / slope;
            }
        } else {
            const Strided<Vec3f> to = chunk.read(center);
            for (std::size_t i = 0; i < chunk.size(); ++i) towards[i] = to[i].cast<double>() - chunk.P[i];
        }
        const Strided<float> size = chunk.read(strength);
        const auto power = [&](double x) { return falloff == 2 ? x * std::sqrt(x) : std::pow(x, 0.5 * (falloff + 1)); };
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            const double d2 = towards[i].squaredNorm();
            if (d2 > 0) forces.add(i, size[i] / power(d2 + core * core) * towards[i]);
        }
    }

    // A force towards a shape's surface has a potential only for an exact distance field, which is not known.
    bool add_potential(const Chunk& chunk, std::span<double> energy) const
    {
        if (shape) return false;
        const Strided<Vec3f> to = chunk.read(center);
        const Strided<float> size = chunk.read(strength);
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            const double d2 = (to[i].cast<double>() - chunk.P[i]).squaredNorm() + core * core;
            energy[i] +=
                size[i] * (falloff == 1 ? 0.5 * std::log(d2) : std::pow(d2, 0.5 * (1 - falloff)) / (1 - falloff));
        }
        return true;
    }
};
RAPID_NODE(Attract);

}  // namespace
}  // namespace rapid
