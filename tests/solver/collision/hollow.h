// Shapes for tests: a hollow ball, which keeps points inside, and a ball with a narrow band, like that of a level set.
#pragma once

#include "runtime/shapes/first_contact.h"

namespace rapid::test {

class HollowBall final : public ShapeOf<HollowBall> {
public:
    explicit HollowBall(double radius) : sampler_{radius} {}

    struct Sampler {
        double radius;
        double distance(const Vec3d& P) const { return radius - P.norm(); }
        double distance(const Vec3d& P, Vec3d& gradient) const
        {
            const double size = P.norm();
            gradient = size > 0 ? Vec3d(-P / size) : Vec3d(Vec3d::Zero());
            return radius - size;
        }
        double slope_bound() const { return 1; }
        double smallest_feature() const { return radius / 100; }
        Box3d bounds() const
        {
            const double inf = std::numeric_limits<double>::infinity();
            return {Vec3d::Constant(-inf), Vec3d::Constant(inf)};
        }
        double rounding() const { return 0x1p-50 * radius; }
    };
    Sampler sampler() const { return sampler_; }
    Box3d bounds() const override { return sampler_.bounds(); }

private:
    Sampler sampler_;
};

class NarrowBall final : public ShapeOf<NarrowBall> {
public:
    NarrowBall(double radius, double band) : sampler_{radius, band} {}

    struct Sampler {
        double radius, half_width;
        double distance(const Vec3d& P) const { return std::clamp(P.norm() - radius, -half_width, half_width); }
        double distance(const Vec3d& P, Vec3d& gradient) const
        {
            const double phi = distance(P);
            gradient = std::abs(phi) < half_width ? P.normalized() : Vec3d(Vec3d::Zero());
            return phi;
        }
        double slope_bound() const { return 1; }
        double smallest_feature() const { return half_width / 3; }
        Box3d bounds() const { return {Vec3d::Constant(-radius - half_width), Vec3d::Constant(radius + half_width)}; }
    };
    Sampler sampler() const { return sampler_; }
    Box3d bounds() const override { return sampler_.bounds(); }

private:
    Sampler sampler_;
};

}  // namespace rapid::test
