// The state of a point that has met a shape in this substep: the remaining time, the surfaces that support it, and its
// next path.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "runtime/shapes/shape.h"
#include "runtime/solver/collision/slide.h"

namespace rapid {

// The work of forces on a point, J/kg, computed from the accelerations that represent them. The rest of the change in
// kinetic energy is the work of contacts.
struct ForceWork {
    double kinetic = 0;  // J/kg, initial
    double work = 0;     // J/kg, up to the position `from`
    Vec3d from = Vec3d::Zero();

    void begin(const Vec3d& P, const Vec3d& v) { *this = {0.5 * v.squaredNorm(), 0, P}; }
    void advance(const Vec3d& P, const Vec3d& a) { work += a.dot(P - from), from = P; }
    double contact_work(const Vec3d& v) const
    {
        constexpr double rounding = 1e-12;
        const double now = 0.5 * v.squaredNorm(), by_contacts = now - kinetic - work;
        return std::abs(by_contacts) > rounding * (now + kinetic + std::abs(work)) ? by_contacts : 0;
    }
};

// Limit of contacts, plus pieces of a path along a curved surface, that a point may have in one substep before the
// rest is dropped.
constexpr int max_contacts = 100000;

// The shortest piece of a path along a curved surface whose shape has no smallest feature, relative to the substep.
constexpr double min_piece = 1.0 / 4096;

struct CollidingPoint {
    enum PathKind {
        Free,
        Straight,  // along flat surfaces
        Curved,    // along a curved surface; `path` is then the chord
        Waits,     // its path is planned again, using what is now known of the surface
    };

    // The end of a piece along a curved surface.
    struct PieceEnd {
        Vec3d P = Vec3d::Zero(), v = Vec3d::Zero(), n = Vec3d::Zero();
        Vec3d a = Vec3d::Zero();  // of the piece, at its beginning
        double curvature = 0;     // 1/m
    };

    std::uint32_t i = 0;  // in the block
    double left = 0;      // s, remaining in the substep
    double piece = 0;     // s: the length of the next piece along a curved surface
    int events = 0;       // counted towards max_contacts
    int ejections = 0;    // number of times that it was moved out of a shape
    ForceWork by_forces;  // since it met a shape; only under linear forces

    // Position and event count at the last check for chatter.
    int checked_events = 0;
    Vec3d checked_P = Vec3d::Constant(std::numeric_limits<double>::infinity());

    int supports = 0;  // surfaces that it rests on; on two it moves along their edge
    Support on[2] = {};

    // The next path.
    Path path{Vec3d::Zero(), Vec3d::Zero(), Vec3d::Zero(), 0, 0};
    PathKind kind = Free;
    bool stops = false;                                 // at the end of the path, on the surface
    PieceEnd end;                                       // of a curved path
    Vec3d slip = Vec3d::Zero(), drive = Vec3d::Zero();  // velocity and acceleration of a point slowed by viscosity

    void begin(std::uint32_t point, double dt)
    {
        i = point;
        left = piece = dt;
        events = ejections = checked_events = supports = 0;
        checked_P.setConstant(std::numeric_limits<double>::infinity());
        kind = Free;
        stops = false;
    }

    bool rests_on(int obstacle) const
    {
        return (supports > 0 && on[0].collider == obstacle) || (supports > 1 && on[1].collider == obstacle);
    }
    // Returns true if all surfaces that it rests on are flat.
    bool is_on_flat() const { return on[0].flat && (supports < 2 || on[1].flat); }

    // Ends the path after `duration` at the latest.
    void limit_path(double duration)
    {
        if (path.duration > duration) path.duration = duration, stops = false;
    }
};

}  // namespace rapid
