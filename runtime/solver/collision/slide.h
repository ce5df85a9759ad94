// The motion of a point that rests on a surface: along it, with the smallest normal force that keeps it there, and
// with Coulomb friction.
#pragma once

#include "runtime/math/vec.h"

namespace rapid {

// A surface that a point rests on.
struct Support {
    int collider = 0;          // index among the colliders
    Vec3d n = Vec3d::Zero();   // unit normal out of it
    Vec3d vc = Vec3d::Zero();  // its velocity, m/s
    double curvature = 0;      // 1/m, in the direction of motion; above 0 if the surface falls away
    double friction = 0;       // μ
    bool flat = false;         // a plane
    double feature = 0;        // m, the shape's smallest
    Vec3d ac = Vec3d::Zero();  // m/s², of uniform motion along the surface in the body's frame (MovingBody)
    double viscosity = 0;      // 1/s
    double adhesion = 0;       // m/s²: an acceleration off the surface below this does not lift the point
};

// The shortest piece of a slide if the direction of friction turns, relative to the substep.
constexpr double min_turning_piece = 1.0 / 256;

// Removes the normal part of a velocity, in the surface's frame.
Vec3d tangential_to(const Support& on, const Vec3d& v);

// The next part of the motion: a parabola of constant acceleration in the surface's frame, assuming a flat surface.
struct Slide {
    enum Kind {
        Leaves,  // nothing presses the point to the surface: it moves freely
        Sticks,  // static friction holds it
        Moves,
    };
    Kind kind;
    Vec3d a = Vec3d::Zero();  // m/s²
    double duration = 0;      // s
    bool stops = false;       // at the end the point has come to a stop on the surface
};

// Returns the next slide. `v` is tangential to the surface in its own frame; `least` (s) is the shortest piece with
// turning friction.
Slide slide_on(const Support& support, const Vec3d& v, const Vec3d& a, double left, double least);

// A parabola that represents the motion v' = a - k v over the time t, s, with the same final position and velocity.
struct Parabola {
    Vec3d v, a;  // m/s at its beginning; m/s²
};
Parabola relaxed(const Vec3d& v, const Vec3d& a, double k, double t);

// Returns the parallel transport of a vector x along a surface, from a position with normal n to one with normal n1:
// the smallest rotation that takes n to n1.
Vec3d transported(const Vec3d& x, const Vec3d& n, const Vec3d& n1);

// Returns the unit vector along the edge of two surfaces; zero if they are (nearly) parallel.
Vec3d edge_of(const Support& A, const Support& B);

// The same along the edge of two surfaces; `v` is along it. `lifted`: the surface from which the acceleration pulls
// the point (0 or 1), or -1.
Slide slide_along(const Support& A, const Support& B, const Vec3d& v, const Vec3d& a, double left, int& lifted);

}  // namespace rapid
