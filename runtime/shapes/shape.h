// Everything a particle can collide with or be born from: a signed distance, a gradient, a first contact along a path.
//
// Distances are in metres, negative inside; gradients point out of the shape. All queries take many points at once: one
// virtual call a chunk, never one a point. A shape is immutable, and may be queried from any number of threads.
//
// A shape must give bounds(), distance() and first_contact(). ShapeOf (first_contact.h) derives the last two from
// a sampler of the distance; the other functions have defaults that hold for a shape at rest with an exact distance.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "runtime/object.h"
#include "runtime/shapes/path.h"
#include "runtime/vec.h"

namespace rapid {

// Where a path first meets the shape from outside. A point that starts flush with the surface (within rounding) is
// outside it: it touches at s = 0 only if it moves, or is pressed, inwards.
struct Contact {
    static constexpr double none = std::numeric_limits<double>::infinity();

    double time = none;        // s along the path
    Vec3d n = Vec3d::Zero();   // unit normal, out of the surface
    Vec3d vc = Vec3d::Zero();  // velocity of the surface there, m/s
    double curvature = 0;      // 1/m, of the surface in the direction of the path; above 0 where it falls away
    bool flat = false;         // the surface is an infinite plane

    // Above 0 for a path that starts inside (time is then 0): the distance along n, m, to where distance = radius.
    // Where the field has no gradient n is zero; `back` is then a time by which the point, going straight back relative
    // to the surface, has left the shape or reached a gradient. It is infinite for a point with the surface's velocity.
    double depth = 0;
    double back = none;
};

// The points with n · x <= offset, m.
struct HalfSpace {
    Vec3d n;
    double offset;
};

class Mesh;
class Scatter;

class Shape : public Object {
public:
    static constexpr std::string_view param_type = "shape";
    std::string_view kind() const override { return "shape"; }

    // The distance is above 0 outside it. May be infinite; contacts are found only within it, widened by the radius.
    virtual Box3d bounds() const = 0;

    // Signed distances and, unless `gradient` is empty, their gradients (not normalised; zero where there is none: deep
    // inside, on a medial axis). All of shape [n]. Beyond a level set's band the distance is a bound of the right sign.
    virtual void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const = 0;

    // The same for a shape that moves, each point at its own time, s since the beginning of the frame.
    virtual void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                             std::span<Vec3d> gradient) const
    {
        static_cast<void>(time);
        distance(P, phi, gradient);
    }
    // Whether it moves or deforms during the frame.
    virtual bool moves() const { return false; }
    // The velocity of the body at a place, m/s.
    virtual Vec3d velocity_at(const Vec3d& P, double time) const
    {
        static_cast<void>(P), static_cast<void>(time);
        return Vec3d::Zero();
    }

    // The first contact of each path; shapes [n], [n].
    virtual void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const = 0;

    // The half space that the shape is, if it is one: callers then need no queries.
    virtual std::optional<HalfSpace> half_space() const { return std::nullopt; }

    // The largest |distance| that is exact: infinite for analytic shapes, the half width of a narrow band.
    virtual double band() const { return std::numeric_limits<double>::infinity(); }

    // The largest slope of the distance: 1 except for fields that are not exact distances.
    virtual double slope_bound() const { return 1; }

    // A wall thinner than this may be missed, and a crease of a smaller radius is a kink, m: one voxel of a level set.
    // 0: the shape is convex, and nothing is missed.
    virtual double smallest_feature() const { return 0; }

    // Where particles are born on or in it (scatter.h). A shape of finite area or volume overrides these; by default
    // they throw an error that says so.
    virtual std::shared_ptr<const Scatter> surface_scatter() const;
    virtual std::shared_ptr<const Scatter> volume_scatter() const;

    // Its surface as a mesh, for pictures. Null if it is infinite.
    virtual std::shared_ptr<const Mesh> surface() const { return nullptr; }
};

using ShapePtr = std::shared_ptr<const Shape>;

}  // namespace rapid
