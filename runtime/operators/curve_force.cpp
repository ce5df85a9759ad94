// curve_force: points are drawn to a curve, and driven along it.
//
//   a = -k (v - speed t) - w2 (P - c)          k = w drag, w2 = w pull;  w = (1 - (d/radius)²)², 1 without a radius
//
//   c    the place of the curve nearest to P, at the distance d
//   t    the curve's direction there: between those at the ends of a segment, each along its two neighbours
//
// The integrator solves both parts together: no pull is too stiff. c is that in the middle of a sub-step, and held for
// it: of second order along the curve. Beyond the ends of an open curve there is no force.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "runtime/graph/node.h"
#include "runtime/graph/points_object.h"

namespace rapid {
namespace {

// {{x, y, z}, ...}, or points in the order in which the curve goes through them.
struct CurvePoints {
    static constexpr std::string_view param_type = "list of vec3, or points";

    std::vector<Vec3d> P;
};

void read_value(const Param& param, const Value& value, CurvePoints& curve)
{
    curve.P.clear();
    if (const auto points = value.object<PointsObject>()) {
        for (std::size_t i = 0; i < points->points.size(); ++i) curve.P.push_back(points->points.P()[i].cast<double>());
    } else {
        if (!value.table()) wrong_type(param, value);
        rapid::read_value(param, value, curve.P);
    }
    for (std::size_t i = 0; i + 1 < curve.P.size(); ++i)
        if (curve.P[i] == curve.P[i + 1])
            throw Error(fmt::format("{}: points {} and {} are at one place; a curve goes from place to place",
                                    param.name, i + 1, i + 2));
    if (curve.P.size() < 2)
        throw Error(fmt::format("{} has {} points; a curve needs at least two", param.name, curve.P.size()));
}

struct CurveForce {
    CurvePoints curve;
    bool closed;
    PerPoint<float> speed, pull, drag;
    std::optional<PerPoint<float>> radius;
    std::string group;

    static NodeType declare()
    {
        return node<CurveForce>("curve_force", "Draws points to a curve, and drives them along it.")
            .param(&CurveForce::curve, "curve", Value(), any_number(), "m",
                   "{{x, y, z}, ...} or points, in the order of the curve")
            .required()
            .param(&CurveForce::closed, "closed", false, any_number(), "", "from the last point to the first, too")
            .param(&CurveForce::speed, "speed", 1.0, any_number(), "m/s", "along the curve; below 0: backwards")
            .param(&CurveForce::pull, "pull", 10.0, at_least(0), "1/s²", "towards the curve, a metre of distance")
            .param(&CurveForce::drag, "drag", 3.0, at_least(0), "1/s", "the rate at which points come to the speed")
            .param(&CurveForce::radius, "radius", Value(), above(0), "m",
                   "the distance at which the force has fallen to 0; without it, it does not fall");
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        const Strided<float> along = chunk.read(speed), towards = chunk.read(pull), rate = chunk.read(drag);
        const Strided<float> reach = radius ? chunk.read(*radius) : Strided<float>{nullptr, 0};
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            const Nearest nearest = nearest_to(chunk.P[i]);
            if (nearest.beyond) continue;
            const double part = radius ? 1 - nearest.distance2 / std::pow(double(reach[i]), 2) : 1;
            if (part <= 0) continue;
            forces.add_drag(i, rate[i] * part * part, along[i] * nearest.direction);
            forces.add_spring(i, towards[i] * part * part, nearest.place);
        }
    }

private:
    struct Nearest {
        Vec3d place, direction;
        double distance2 = std::numeric_limits<double>::infinity();
        bool beyond = false;  // an end of an open curve
    };

    std::size_t segments() const { return closed ? curve.P.size() : curve.P.size() - 1; }
    const Vec3d& at(std::size_t i) const { return curve.P[i % curve.P.size()]; }

    // The curve's direction at one of its points: of length 1.
    Vec3d direction_at(std::size_t i) const
    {
        const std::size_t n = curve.P.size();
        const Vec3d& before = closed ? at(i + n - 1) : at(i == 0 ? 0 : i - 1);
        const Vec3d& after = closed ? at(i + 1) : at(std::min(i + 1, n - 1));
        const Vec3d d = after - before;
        const Vec3d& next = at(i + 1 < n || closed ? i + 1 : i);
        return d.norm() > 0 ? Vec3d(d.normalized()) : Vec3d((next - at(i)).normalized());  // it turns back there
    }

    Nearest nearest_to(const Vec3d& P) const
    {
        Nearest found;
        std::size_t on = 0;
        double part = 0;
        for (std::size_t k = 0; k < segments(); ++k) {
            const Vec3d way = at(k + 1) - at(k);
            const double u = (P - at(k)).dot(way) / way.squaredNorm();
            const Vec3d place = at(k) + std::clamp(u, 0.0, 1.0) * way;
            const double d2 = (P - place).squaredNorm();
            if (d2 < found.distance2) found.place = place, found.distance2 = d2, on = k, part = u;
        }
        if (!closed) found.beyond = (on == 0 && part < 0) || (on + 1 == segments() && part > 1);
        part = std::clamp(part, 0.0, 1.0);
        const Vec3d direction = (1 - part) * direction_at(on) + part * direction_at((on + 1) % curve.P.size());
        found.direction =
            direction.norm() > 0 ? Vec3d(direction.normalized()) : Vec3d((at(on + 1) - at(on)).normalized());
        return found;
    }
};
RAPID_NODE(CurveForce);

}  // namespace
}  // namespace rapid
