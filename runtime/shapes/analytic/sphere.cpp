// A solid sphere.
#include <fmt/format.h>

#include <numbers>

#include "runtime/base/error.h"
#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/analytic/shape_type.h"
#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {
namespace {

struct SphereSampler {
    Vec3d center;
    double radius;  // m

    double distance(const Vec3d& P) const { return (P - center).norm() - radius; }
    double distance(const Vec3d& P, Vec3d& gradient) const
    {
        const Vec3d d = P - center;
        const double size = d.norm();
        gradient = size > 0 ? Vec3d(d / size) : Vec3d(Vec3d::Zero());  // at the centre all directions are equally near
        return size - radius;
    }
    double slope_bound() const { return 1; }
    double smallest_feature() const { return 0; }
    Box3d bounds() const { return {center - Vec3d::Constant(radius), center + Vec3d::Constant(radius)}; }
    double rounding() const { return 0x1p-50 * (radius + center.cwiseAbs().maxCoeff()); }
};

Vec3d direction(double u1, double u2)
{
    const double z = 1 - 2 * u1, around = 2 * std::numbers::pi * u2, out = std::sqrt(std::max(0.0, 1 - z * z));
    return {out * std::cos(around), out * std::sin(around), z};
}

// Samples uniformly by area or by volume.
class ScatterOnSphere final : public Scatter {
public:
    ScatterOnSphere(const SphereSampler& sphere, bool inside) : sphere_(sphere), inside_(inside) {}

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        for (std::size_t i = 0; i < out.size(); ++i) {
            const auto u = uniform4(key, first + i, 0);
            const Vec3d n = direction(u[0], u[1]);
            const double from_center = sphere_.radius * (inside_ ? std::cbrt(u[2]) : 1);
            out[i] = Birthplace{};
            out[i].P = (sphere_.center + from_center * n).cast<float>();
            if (!inside_) out[i].N = n.cast<float>();
        }
    }

private:
    SphereSampler sphere_;
    bool inside_;
};

class Sphere final : public ShapeOf<Sphere> {
public:
    Sphere(double radius, const Vec3d& center) : sampler_{center, radius} {}

    std::string_view kind() const override { return "sphere"; }
    const SphereSampler& sampler() const { return sampler_; }
    Box3d bounds() const override { return sampler_.bounds(); }

    ScatterPtr surface_scatter() const override { return std::make_shared<ScatterOnSphere>(sampler_, false); }
    ScatterPtr volume_scatter() const override { return std::make_shared<ScatterOnSphere>(sampler_, true); }
    MeshPtr surface() const override
    {
        constexpr int divisions = 64;  // facets of 6 degrees look smooth in a picture 720 pixels high
        return make_sphere(sampler_.radius, divisions, sampler_.center);
    }

private:
    SphereSampler sampler_;
};

}  // namespace

ShapePtr make_sphere_shape(double radius, const Vec3d& center)
{
    if (!(radius > 0) || !std::isfinite(radius))
        throw Error(fmt::format("radius of a sphere = {:g} is out of range; it must be above 0", radius));
    return std::make_shared<Sphere>(radius, center);
}

namespace {

struct SphereType {
    double radius;
    Vec3d center;

    static ShapeType declare()
    {
        return shape_type<SphereType>("sphere", "Returns a sphere.")
            .length(&SphereType::radius, "radius", 1.0, "radius of the sphere")
            .param(&SphereType::center, "center", Vec3d(0, 0, 0), "m", "centre");
    }
    ShapePtr make() const { return make_sphere_shape(radius, center); }
};
RAPID_SHAPE(SphereType);

}  // namespace
}  // namespace rapid
