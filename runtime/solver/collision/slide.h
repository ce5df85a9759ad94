// How a point moves that rests on a surface: along it, with the surface's force just large enough to keep it there, and
// with Coulomb's friction.
#pragma once

#include "runtime/vec.h"

namespace rapid {

// A surface that a point rests on.
struct Support {
    int collider;      // place among the colliders
    Vec3d n, vc;       // unit normal out of it, and its velocity, m/s
    double curvature;  // 1/m, in the direction of motion; above 0 where the surface falls away
    double friction;   // μ
    bool flat;         // a plane
    double feature;    // m, the shape's smallest

    // m/s², of what goes straight on along the surface as the body sees it (RigidBody)
    Vec3d ac = Vec3d::Zero();
};

// What comes next: the parabola of constant acceleration `a`, in the surface's frame, for `duration`, if the surface
// stays flat.
struct Slide {
    enum Kind {
        Leaves,  // nothing presses the point to the surface: it moves freely
        Sticks,  // it stays where it is, until something else changes
        Moves,
    };
    Kind kind;
    Vec3d a = Vec3d::Zero();  // m/s²
    double duration = 0;      // s
    bool stops = false;       // at the end of the duration the point has come to a stop on the surface
};

// `v` is tangential to the surface in its own frame. `least` (s) is the shortest piece that a change of direction
// makes.
Slide slide_on(const Support& support, const Vec3d& v, const Vec3d& a, double left, double least);

// A vector x along a surface of normal n, carried to where the normal is n1: turned by the least rotation that takes n
// to n1.
Vec3d carried(const Vec3d& x, const Vec3d& n, const Vec3d& n1);

// The edge that two surfaces make, as the unit vector along it; zero where they are (nearly) parallel.
Vec3d edge_of(const Support& A, const Support& B);

// The same along the edge of two surfaces; `v` is along it. `lifted` says which surface the acceleration draws the
// point off (0 or 1), or -1.
Slide slide_along(const Support& A, const Support& B, const Vec3d& v, const Vec3d& a, double left, int& lifted);

}  // namespace rapid
