// Everything a particle can hit or be born from: a signed distance, a gradient, a first contact along a path.
//
// Distances are in metres, negative inside; gradients point out of the shape. All queries are for many points at once:
// the virtual call is one a chunk, never one a point. A shape is immutable, and asked from any number of threads.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "runtime/object.h"
#include "runtime/vec.h"

namespace rapid {

// A piece of one point's way: the parabola x(s) = P + v s + a s²/2 for s in [0, duration], in seconds.
struct Path {
    Vec3d P, v, a;
    double duration;
    double radius;     // m; contact is where distance = radius
    double begin = 0;  // s since the beginning of the frame, for shapes that move in it
};

// Where a path first meets the shape from outside. A point that starts flush with the surface (within rounding) is
// outside it: it touches at s = 0 only when it moves, or is pressed, inwards.
struct Contact {
    static constexpr double none = std::numeric_limits<double>::infinity();

    double time = none;        // s along the path
    Vec3d n = Vec3d::Zero();   // unit normal, out of the surface
    Vec3d vc = Vec3d::Zero();  // velocity of the surface there, m/s
    double curvature = 0;      // 1/m, of the surface in the direction of the path; above 0 where it falls away
    bool flat = false;         // the surface is a plane, as far as any path goes

    // Above 0 for a path that starts inside (time is then 0): as far away, in m, is the surface of the points that the
    // radius keeps out, along n. Where the field has no gradient n is zero; `back` is then the time by which the point
    // went in along a straight line as the surface sees it, or farther than it went where that time is not known, and
    // infinite for a point that has the surface's velocity.
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

    // Where the distance can be below `radius`. May be infinite; outside it no contact is looked for.
    virtual Box3d bounds() const = 0;

    // Signed distances, and where `gradient` is not empty their gradients (not normalised; zero where there is none:
    // deep inside, at a medial axis). All of shape [n]. Beyond a level set's band the distance is a bound of the right
    // sign.
    virtual void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const = 0;

    // The same of a shape that moves, each point at its own time, s since the beginning of the frame.
    virtual void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                             std::span<Vec3d> gradient) const
    {
        static_cast<void>(time);
        distance(P, phi, gradient);
    }
    // Whether it is elsewhere, or otherwise, within the frame.
    virtual bool moves() const { return false; }
    // The velocity of the body at a place, m/s.
    virtual Vec3d velocity_at(const Vec3d& P, double time) const
    {
        static_cast<void>(P), static_cast<void>(time);
        return Vec3d::Zero();
    }

    // The first contact of each path; shapes [n], [n].
    virtual void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const = 0;

    // What it is, where it is one: whoever asks about many points then need not.
    virtual std::optional<HalfSpace> half_space() const { return std::nullopt; }

    // The largest |distance| that is exact: infinite for analytic shapes, the half width of a narrow band.
    virtual double band() const { return std::numeric_limits<double>::infinity(); }

    // The largest slope of the distance: 1 but for fields that are no exact distances.
    virtual double slope_bound() const { return 1; }

    // A wall thinner than this may be missed, and a crease of a smaller radius is a kink, m: one voxel of a level set.
    virtual double smallest_feature() const { return 0; }

    // Where particles are born on or in it (scatter.h). A shape of finite area or volume overrides these; the others
    // throw an error that says so.
    virtual std::shared_ptr<const Scatter> surface_scatter() const;
    virtual std::shared_ptr<const Scatter> volume_scatter() const;

    // Its surface as a mesh, for pictures. Null where it is infinite.
    virtual std::shared_ptr<const Mesh> surface() const { return nullptr; }
};

using ShapePtr = std::shared_ptr<const Shape>;

}  // namespace rapid
