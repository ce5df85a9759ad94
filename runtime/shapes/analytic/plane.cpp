// The half space below a plane. Contacts are the roots of a quadratic: exact for a bouncing ball.
#include <fmt/format.h>

#include "runtime/base/error.h"
#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/analytic/shape_type.h"
#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/path.h"

namespace rapid {
namespace {

struct PlaneSampler {
    Vec3d n;        // unit, points out of the half space
    double offset;  // m, along n

    double distance(const Vec3d& P) const { return n.dot(P) - offset; }
    double distance(const Vec3d& P, Vec3d& gradient) const
    {
        gradient = n;
        return distance(P);
    }
};

class Plane final : public Shape {
public:
    Plane(const Vec3d& n, double offset) : sampler_{n, offset}
    {
        const double inf = std::numeric_limits<double>::infinity();
        bounds_ = Box3d(Vec3d::Constant(-inf), Vec3d::Constant(inf));
        for (int k = 0; k < 3; ++k) {
            if (n[k] == 1) bounds_.max()[k] = offset;
            if (n[k] == -1) bounds_.min()[k] = -offset;
        }
    }

    std::string_view kind() const override { return "plane"; }
    Box3d bounds() const override { return bounds_; }
    std::optional<HalfSpace> half_space() const override { return HalfSpace{sampler_.n, sampler_.offset}; }

    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        const PlaneSampler sampler = sampler_;
        for (std::size_t i = 0; i < P.size(); ++i) phi[i] = sampler.distance(P[i]);
        std::fill(gradient.begin(), gradient.end(), sampler.n);
    }

    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        const PlaneSampler sampler = sampler_;
        const double rounding = 0x1p-50 * std::abs(sampler.offset);
        for (std::size_t i = 0; i < paths.size(); ++i) {
            const Path& path = paths[i];
            Contact& contact = contacts[i] = Contact();
            const double f = sampler.distance(path.P) - path.radius;
            double vn = sampler.n.dot(path.v);
            const double an = sampler.n.dot(path.a), T = path.duration;
            const double flush = flush_within(path.P, path.radius, rounding);
            // The most common case by far: the point stays above the plane throughout the step.
            if (f > flush && f + T * (vn + 0.5 * T * an) > 0 && (an <= 0 || vn >= 0)) continue;

            if (f <= flush && is_along(vn, path.v)) vn = 0;
            if (f < -flush) {
                contact.time = 0;
                contact.depth = -f;
            } else if (f <= flush && (vn < 0 || stays_on_plane(vn, -an, flush, T))) {
                contact.time = 0;
            } else {
                const double s = first_fall_through(std::max(f, 0.0), vn, an);
                if (!(s < T)) continue;
                contact.time = s;
            }
            contact.n = sampler.n;
            contact.flat = true;
        }
    }

private:
    PlaneSampler sampler_;
    Box3d bounds_;
};

}  // namespace

ShapePtr make_plane(const Vec3d& normal, double offset)
{
    // Scales first, because the squares of the components may be beyond the range of a double.
    const double largest = normal.cwiseAbs().maxCoeff();
    if (!(largest > 0) || !std::isfinite(largest))
        throw Error(fmt::format("normal of a plane = {{{:g}, {:g}, {:g}}} has no direction; its length must be above 0",
                                normal.x(), normal.y(), normal.z()));
    if (!std::isfinite(offset)) throw Error(fmt::format("offset of a plane = {:g}; it must be finite", offset));
    // An axis stays bit-identical, so that the weight of a point at rest on the plane has no tangential part.
    const Vec3d scaled = normal / largest;
    return std::make_shared<Plane>(scaled.normalized(), offset / largest / scaled.norm());
}

namespace {

struct PlaneType {
    Vec3d normal;
    double offset;

    static ShapeType declare()
    {
        return shape_type<PlaneType>("plane", "Returns a plane, whose normal points outside.")
            .param(&PlaneType::normal, "normal", Vec3d(0, 1, 0), "",
                   "normal of any nonzero length, which points out of the solid half")
            .param(&PlaneType::offset, "offset", 0.0, "m", "distance from the origin along the normal");
    }
    ShapePtr make() const { return make_plane(normal, offset); }
};
RAPID_SHAPE(PlaneType);

}  // namespace
}  // namespace rapid
