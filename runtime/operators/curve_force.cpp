// curve_force: draws points to a curve and drives them along it.
//
//   a = -k (v - speed t) - w2 (P - c)          k = w drag, w2 = w pull;  w = (1 - (d/radius)²)², 1 without a radius
//
//   c    the position on the curve nearest to P, at the distance d
//   t    the curve's direction there, interpolated along a segment between its ends, each along its two neighbours
//
//   vc   the velocity of c if the curve moves:  a = -k (v - vc - speed t) - ...
//
// The integrator solves both parts together, so no pull is too stiff. c is taken at the middle of a substep and held
// constant, which is of second order along the curve. There is no force beyond the ends of an open curve.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "runtime/graph/curve_value.h"
#include "runtime/graph/node.h"
#include "runtime/graph/points_object.h"
#include "runtime/graph/step_shape.h"

namespace rapid {
namespace {

// {{x, y, z}, ...}, points in the order of the curve, or curve objects, which may move.
struct AnyCurves {
    static constexpr std::string_view param_type = StepCurves::param_type;

    std::vector<Vec3d> P;                            // positions if at rest
    std::shared_ptr<const CurveLines> open, closed;  // equal for curve objects, which say if they are closed
    std::shared_ptr<const StepCurves> step;          // if it moves
    bool is_list = false;
};

void read_value(const Param& param, const Value& value, AnyCurves& field)
{
    field = {};
    if (const auto step = value.object<StepCurves>()) {
        field.step = step;
        field.open = field.closed = step->lines();
        return;
    }
    CurvesPtr curves = value.object<Curves>();
    if (value.table()) {
        rapid::read_value(param, value, field.P);
        if (field.P.size() < 2)
            throw Error(fmt::format("{} has {} points; a curve needs at least two", param.name, field.P.size()));
        for (std::size_t i = 0; i + 1 < field.P.size(); ++i)
            if (field.P[i] == field.P[i + 1])
                throw Error(
                    fmt::format("{}: points {} and {} have the same position; remove one", param.name, i + 1, i + 2));
        const std::size_t count = field.P.size();
        field.open = std::make_shared<CurveLines>(std::span(&count, 1), false);
        field.closed = std::make_shared<CurveLines>(std::span(&count, 1), true);
        field.is_list = true;
        return;
    }
    if (const auto points = value.object<PointsObject>()) {
        curves = curves_of(points->points, false, param.name);
        field.closed = curves_of(points->points, true, param.name)->lines();
        field.is_list = true;
    }
    if (!curves) wrong_type(param, value);
    field.open = curves->lines();
    if (!field.closed) field.closed = field.open;
    for (const Vec3f& P : curves->points()) field.P.push_back(P.cast<double>());
}

struct CurveForce {
    AnyCurves curve;
    bool closed;
    PerPoint<float> speed, pull, drag;
    std::optional<PerPoint<float>> radius;
    std::string group;

    static NodeType declare()
    {
        return node<CurveForce>("curve_force", "Pulls points to a curve and drives them along it.")
            .param(&CurveForce::curve, "curve", Value(), any_number(), "m",
                   "list of positions {{x, y, z}, ...}, points, or a rapid.curve, which may move and deform")
            .required()
            .param(&CurveForce::closed, "closed", false, any_number(), "", "connects the last point to the first")
            .param(&CurveForce::speed, "speed", 1.0, any_number(), "m/s",
                   "speed along the curve; a negative value drives points backwards")
            .param(&CurveForce::pull, "pull", 10.0, at_least(0), "1/s²",
                   "acceleration towards the curve per metre of distance")
            .param(&CurveForce::drag, "drag", 3.0, at_least(0), "1/s", "rate at which points reach the speed")
            .param(&CurveForce::radius, "radius", Value(), above(0), "m",
                   "distance at which the force has fallen to 0; without it the force does not decrease");
    }

    void check() const
    {
        if (closed && !curve.is_list)
            throw Error(
                "closed needs a list of positions; to close a curve, give rapid.curve.from { points = ..., closed = "
                "true }");
    }

    void contribute(const Chunk& chunk, Forces& forces) const
    {
        const CurveLines* lines = (closed ? curve.closed : curve.open).get();
        if (!lines) return;  // a sequence without curves in this step
        const Strided<float> along = chunk.read(speed), towards = chunk.read(pull), rate = chunk.read(drag);
        const Strided<float> reach = radius ? chunk.read(*radius) : Strided<float>{nullptr, 0};
        std::vector<Vec3d> P, v;
        double time = std::numeric_limits<double>::quiet_NaN();  // of P and v
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            if (curve.step && chunk.time[i] != time) curve.step->at(time = chunk.time[i], P, v);
            const Nearest nearest = nearest_to(chunk.P[i], *lines, curve.step ? P : curve.P, v);
            if (nearest.is_beyond_end) continue;
            const double part = radius ? 1 - nearest.distance2 / std::pow(double(reach[i]), 2) : 1;
            if (part <= 0) continue;
            forces.add_drag(i, rate[i] * part * part, along[i] * nearest.direction + nearest.v);
            forces.add_spring(i, towards[i] * part * part, nearest.position);
        }
    }

private:
    struct Nearest {
        Vec3d position, direction, v = Vec3d::Zero();
        double distance2 = std::numeric_limits<double>::infinity();
        bool is_beyond_end = false;  // an end of an open curve
    };

    // Returns the curve's unit direction at one of its points. on_line: the direction of the line.
    static Vec3d direction_at(std::int32_t i, const Vec3d& on_line, const CurveLines& lines,
                              const std::vector<Vec3d>& P)
    {
        const auto at = [&](std::int32_t k) -> const Vec3d& { return P[static_cast<std::size_t>(k >= 0 ? k : i)]; };
        const auto index = static_cast<std::size_t>(i);
        const Vec3d d = at(lines.after[index]) - at(lines.before[index]);
        return d.norm() > 0 ? Vec3d(d.normalized()) : on_line;  // the curve turns back there
    }

    // v: of the curve's points; empty if it is at rest.
    static Nearest nearest_to(const Vec3d& from, const CurveLines& lines, const std::vector<Vec3d>& P,
                              const std::vector<Vec3d>& v)
    {
        Nearest found;
        CurveLines::Line on{};
        double part = 0;
        const auto at = [](const std::vector<Vec3d>& of, std::int32_t k) -> const Vec3d& {
            return of[static_cast<std::size_t>(k)];
        };
        for (const CurveLines::Line& line : lines.lines) {
            const Vec3d &a = at(P, line.a), segment = at(P, line.b) - a;
            const double length2 = segment.squaredNorm(), u = length2 > 0 ? (from - a).dot(segment) / length2 : 0;
            const Vec3d position = a + std::clamp(u, 0.0, 1.0) * segment;
            const double d2 = (from - position).squaredNorm();
            if (d2 < found.distance2) found.position = position, found.distance2 = d2, on = line, part = u;
        }
        found.is_beyond_end = (part < 0 && lines.before[static_cast<std::size_t>(on.a)] < 0) ||
                              (part > 1 && lines.after[static_cast<std::size_t>(on.b)] < 0);
        part = std::clamp(part, 0.0, 1.0);
        const Vec3d on_line = (at(P, on.b) - at(P, on.a)).normalized();
        const Vec3d direction =
            (1 - part) * direction_at(on.a, on_line, lines, P) + part * direction_at(on.b, on_line, lines, P);
        found.direction = direction.norm() > 0 ? Vec3d(direction.normalized()) : on_line;
        if (!v.empty()) found.v = at(v, on.a) + part * (at(v, on.b) - at(v, on.a));
        return found;
    }
};
RAPID_NODE(CurveForce);

}  // namespace
}  // namespace rapid
