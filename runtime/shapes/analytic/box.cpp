// An axis-aligned box.
#include <fmt/format.h>

#include <array>

#include "runtime/base/error.h"
#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/analytic/shape_type.h"
#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {
namespace {

struct BoxSampler {
    Vec3d center, half;  // m

    double distance(const Vec3d& P) const
    {
        const Vec3d beyond = (P - center).cwiseAbs() - half;
        const double most = beyond.maxCoeff();
        return most > 0 ? beyond.cwiseMax(0.0).norm() : most;
    }

    // Also computes the gradient. Outside, it points away from the nearest point of the box. Inside, it points out of
    // the nearest face, or the first one if several are equally near.
    double distance(const Vec3d& P, Vec3d& gradient) const
    {
        const Vec3d d = P - center, beyond = d.cwiseAbs() - half;
        int axis;
        const double most = beyond.maxCoeff(&axis);
        gradient.setZero();
        if (!(most > 0)) {
            gradient[axis] = d[axis] < 0 ? -1 : 1;
            return most;
        }
        const Vec3d out = beyond.cwiseMax(0.0);
        const double size = out.norm();
        for (int k = 0; k < 3; ++k) gradient[k] = std::copysign(out[k] / size, d[k]);
        return size;
    }
    double slope_bound() const { return 1; }
    double smallest_feature() const { return 0; }
    Box3d bounds() const { return {center - half, center + half}; }
    double rounding() const { return 0x1p-50 * (half + center.cwiseAbs()).maxCoeff(); }
};

// Samples uniformly by area, over the three pairs of faces, or by volume.
class ScatterOnBox final : public Scatter {
public:
    ScatterOnBox(const BoxSampler& box, bool inside) : box_(box), inside_(inside)
    {
        const Vec3d& h = box.half;
        const Vec3d areas(h.y() * h.z(), h.z() * h.x(), h.x() * h.y());
        up_to_ = {areas[0] / areas.sum(), (areas[0] + areas[1]) / areas.sum()};
    }

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        for (std::size_t i = 0; i < out.size(); ++i) {
            const auto u = uniform4(key, first + i, 0);
            Vec3d in_box(2 * u[0] - 1, 2 * u[1] - 1, 2 * u[2] - 1), n = Vec3d::Zero();
            if (!inside_) {
                const int axis = u[3] < up_to_[0] ? 0 : u[3] < up_to_[1] ? 1 : 2;
                in_box[axis] = n[axis] = in_box[axis] < 0 ? -1 : 1;
            }
            out[i] = Birthplace{};
            out[i].P = (box_.center + in_box.cwiseProduct(box_.half)).cast<float>();
            out[i].N = n.cast<float>();
        }
    }

private:
    BoxSampler box_;
    bool inside_;
    std::array<double, 2> up_to_;  // a uniform number below these selects a face across x, y
};

class Box final : public ShapeOf<Box> {
public:
    Box(const Vec3d& size, const Vec3d& center) : sampler_{center, size / 2} {}

    std::string_view kind() const override { return "box"; }
    const BoxSampler& sampler() const { return sampler_; }
    Box3d bounds() const override { return sampler_.bounds(); }

    ScatterPtr surface_scatter() const override { return std::make_shared<ScatterOnBox>(sampler_, false); }
    ScatterPtr volume_scatter() const override { return std::make_shared<ScatterOnBox>(sampler_, true); }
    MeshPtr surface() const override { return make_box(2 * sampler_.half, sampler_.center); }

private:
    BoxSampler sampler_;
};

}  // namespace

ShapePtr make_box_shape(const Vec3d& size, const Vec3d& center)
{
    if (!(size.minCoeff() > 0) || !size.allFinite())
        throw Error(fmt::format("size of a box = {{{:g}, {:g}, {:g}}} is out of range; each edge must be above 0",
                                size.x(), size.y(), size.z()));
    return std::make_shared<Box>(size, center);
}

namespace {

struct BoxType {
    Vec3d size, center;

    static ShapeType declare()
    {
        return shape_type<BoxType>("box", "Returns a box.")
            .length(&BoxType::size, "size", Vec3d(1, 1, 1), "full edge lengths")
            .param(&BoxType::center, "center", Vec3d(0, 0, 0), "m", "centre");
    }
    ShapePtr make() const { return make_box_shape(size, center); }
};
RAPID_SHAPE(BoxType);

}  // namespace
}  // namespace rapid
