// The interface to everything that particles can collide with or be emitted from: signed distance, gradient, first
// contact along a path.
//
// Distances are in metres, negative inside; gradients point out of the shape. All queries take many points, so that
// there is one virtual call per chunk instead of one per point. Shapes are immutable and thread-safe.
//
// A shape must implement bounds(), distance() and first_contact(). ShapeOf (first_contact.h) derives the last two from
// a sampler of the distance. The defaults of the other functions suit a shape at rest with an exact distance.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "runtime/base/object.h"
#include "runtime/math/vec.h"
#include "runtime/shapes/path.h"

namespace rapid {

// The first contact of a path with the shape. A point that starts flush with the surface (within rounding) counts as
// outside: it has a contact at s = 0 only if it moves or is pressed inwards.
struct Contact {
    static constexpr double none = std::numeric_limits<double>::infinity();

    double time = none;        // s along the path
    Vec3d n = Vec3d::Zero();   // unit normal, out of the surface
    Vec3d vc = Vec3d::Zero();  // velocity of the surface at the contact, m/s
    double curvature = 0;      // 1/m, of the surface in the direction of the path; positive if the surface falls away
    bool flat = false;         // the surface is an infinite plane

    // Positive if the path starts inside (time is then 0): the distance along n, m, to the level distance = radius, or,
    // deep inside a level set, to where it has a gradient. If the field has no gradient, n is zero. `back` is then the
    // time by which the point, moving straight back relative to the surface, has left the shape or found a gradient. It
    // is infinite if the point moves with the surface.
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

    // Returns the bounding box; the distance is positive outside it. May be infinite. Contacts are found only within
    // it, widened by the radius.
    virtual Box3d bounds() const = 0;

    // Computes signed distances and, unless `gradient` is empty, their gradients (not normalised; zero deep inside and
    // on a medial axis). All have shape [n]. Beyond a level set's band the distance is a bound of the right sign.
    virtual void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const = 0;

    // Does the same for a moving shape, each point at its own time in s since the beginning of the frame.
    virtual void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                             std::span<Vec3d> gradient) const
    {
        static_cast<void>(time);
        distance(P, phi, gradient);
    }
    // Returns true if the shape moves or deforms during the frame.
    virtual bool moves() const { return false; }
    // Returns the velocity of the body at a position, m/s.
    virtual Vec3d velocity_at(const Vec3d& P, double time) const
    {
        static_cast<void>(P), static_cast<void>(time);
        return Vec3d::Zero();
    }

    // Finds the first contact of each path. Shapes [n], [n].
    virtual void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const = 0;

    // Returns the half space if the shape is one. Callers then need no queries.
    virtual std::optional<HalfSpace> half_space() const { return std::nullopt; }

    // Returns the largest |distance| that is exact: infinite for analytic shapes, the half width of a narrow-band level
    // set.
    virtual double band() const { return std::numeric_limits<double>::infinity(); }

    // Returns the largest slope of the distance field: 1 unless the field is not an exact distance.
    virtual double slope_bound() const { return 1; }

    // Returns the resolution in m. A wall thinner than this may be missed, and a crease with a smaller radius is a
    // kink: one voxel for a level set. 0 means that the shape is convex and nothing is missed.
    virtual double smallest_feature() const { return 0; }

    // Samplers of birth positions on or in the shape (scatter.h). A shape of finite area or volume overrides these; the
    // defaults throw an error that says it has none.
    virtual std::shared_ptr<const Scatter> surface_scatter() const;
    virtual std::shared_ptr<const Scatter> volume_scatter() const;

    // Returns the surface as a mesh, for pictures. Null if it is infinite.
    virtual std::shared_ptr<const Mesh> surface() const { return nullptr; }
};

using ShapePtr = std::shared_ptr<const Shape>;

}  // namespace rapid
