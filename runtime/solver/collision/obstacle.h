// A collider as seen by the solver: its shape, with its parameters for all points of a set.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "runtime/math/vec.h"
#include "runtime/points/column.h"
#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/motion/moving_body.h"
#include "runtime/shapes/shape.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

struct Obstacle {
    // radius_of_points: m, must outlive this. Throws Error if a parameter's attribute is missing.
    Obstacle(const Collider& collider, const PointSet& points, Strided<float> radius_of_points);

    const Shape* shape;
    Box3d bounds;
    double feature;  // m, the shape's smallest
    bool moves;
    const MovingBody* body;  // null if it is at rest
    std::optional<HalfSpace> plane;
    Method method;
    Response response;
    std::optional<double> record;  // m/s
    Strided<float> bounce, friction, radius, adhesion, viscosity;
    std::int32_t key;               // identifies its node, above 0: points that it holds store it between frames
    Strided<std::uint8_t> members;  // of its group; 1 for all points if it has none

    bool is_continuous() const { return method == Method::Continuous; }
    bool sticks() const { return response == Response::Stick; }
    // Returns true if it may hold points that slide on it, or slow them down.
    bool clings() const { return response == Response::Slide && (adheres_ || flows_); }
    // Returns true if it may hold points against forces that pull them off.
    bool holds() const { return sticks() || (response == Response::Slide && adheres_); }

    // For the point at this index of the set. Unlimited adhesion applies to held points, not to sliding ones.
    double adhesion_to_sliding(std::size_t point) const { return sticks() ? 0.0 : double(adhesion[point]); }
    double restitution(std::size_t point) const { return response == Response::Bounce ? double(bounce[point]) : 0.0; }

    // Returns the largest radius of these points, m.
    double largest_radius(std::span<const std::uint32_t> points) const;

    // Returns the distance from the surface that counts as touching, m: the rounding of a position to single
    // precision, plus the error of the shape's field.
    double contact_tolerance(const Vec3d& P, double point_radius) const
    {
        return flush_within(P, point_radius, feature * 0x1p-21);
    }

    bool is_clear_of(const Vec3d& P, double point_radius) const
    {
        return ((P - bounds.max()).array() > point_radius).any() || ((bounds.min() - P).array() > point_radius).any();
    }

    // Returns the unit normal of the shape's field; zero if it has none. time: s since the beginning of the frame.
    Vec3d normal_at(const Vec3d& P, double time) const;

    // Returns the acceleration, m/s², of a point that moves with constant velocity in the body's frame.
    Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const
    {
        return body ? body->acceleration_at(P, v, time) : Vec3d(Vec3d::Zero());
    }

private:
    bool adheres_, flows_;
};

// Clears the marks of points that are inside or on an obstacle at the end of the frame, with P rounded to single
// precision. points: indices in the set; all spans have shape [n].
void keep_outside(std::span<const Obstacle> obstacles, std::span<const std::uint32_t> points, std::span<const Vec3d> P,
                  std::span<std::uint8_t> marks);

// Returns the velocity after a contact, given the velocities of the point (v) and of the surface (vc) at the contact,
// m/s, and the unit normal n out of the surface. Paper eq. (4), which is frictionless, follows for friction = 0.
// bounce (ε) in [0, 1], friction (μ) >= 0. Separating pairs keep their velocity.
//
// Uses double precision, because in single precision the speed of a point that bounces forever drifts.
Vec3d contact_response(const Vec3d& v, const Vec3d& vc, const Vec3d& n, double bounce, double friction);

}  // namespace rapid
