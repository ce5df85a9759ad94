#include "runtime/solver/collision/slide.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/solver/motion/damped_motion.h"

namespace rapid {
namespace {

constexpr double never = std::numeric_limits<double>::infinity();

// The largest turn of the friction's direction within a piece, in radians. The error of a piece is of third order in
// it. A point that slides straight down a slope, or on a level floor, is exact at any length.
constexpr double max_turn = 0.05;

// Two surfaces within 0.06 degrees of each other count as one, because the forces along their edge would be
// ill-conditioned.
constexpr double parallel = 1e-3;  // sine of the angle between the normals

// Relative acceleration that rounding leaves along the surface if it should be 0.
constexpr double rounding = 0x1p-48;

// Returns the time in which `along` < 0 reduces a speed to 0, with viscosity: v' = along - k v.
double time_to_stop(double speed, double along, double k)
{
    return k > 0 ? std::log1p(k * speed / -along) / k : -speed / along;
}

}  // namespace

Vec3d tangential_to(const Support& on, const Vec3d& v)
{
    const Vec3d relative = v - on.vc;
    return on.vc + (relative - relative.dot(on.n) * on.n);
}

// With a the acceleration in the surface's frame, N = g - κ |vt|² the normal force per mass, g = -a·n, at = a + g n:
//
//   at rest    the point stays while |at| <= μ N, else a' = at (1 - μ N / |at|)
//   moving     a' = at - μ N vt/|vt|, until it stops, with the direction of vt in the middle of the piece, or at its
//              end if friction could reverse the motion
Slide slide_on(const Support& support, const Vec3d& v, const Vec3d& pull, double left, double least)
{
    const Vec3d& n = support.n;
    const Vec3d a = pull - support.ac;
    const Vec3d relative = v - support.vc;
    const Vec3d vt = relative - relative.dot(n) * n;
    const double g = -a.dot(n), speed2 = vt.squaredNorm();
    const double N = g - support.curvature * speed2;
    if (N < -support.adhesion) return {Slide::Leaves};

    const Vec3d at = a + g * n;
    const double holds = support.friction * std::max(N, 0.0);
    if (!(speed2 > 0)) {
        const double drives = at.norm();
        if (drives <= holds + rounding * a.norm()) return {Slide::Sticks};
        return {Slide::Moves, at * (1 - holds / drives), left};
    }
    if (holds == 0) return {Slide::Moves, at, left};

    const double speed = std::sqrt(speed2);
    const Vec3d direction = vt / speed;
    Slide slide{Slide::Moves, at - holds * direction, left};
    const bool straight = at.isZero(0);  // e.g. on a level floor: friction alone does not turn
    const double along = straight ? -holds : slide.a.dot(direction);
    if (!straight) {
        const double aside2 = (slide.a - along * direction).squaredNorm();
        if (slide.duration * slide.duration * aside2 > max_turn * max_turn * speed2)
            slide.duration = std::min(left, std::max(max_turn * speed / std::sqrt(aside2), least));
    }
    if (const double stop = along < 0 ? time_to_stop(speed, along, support.viscosity) : never; stop <= slide.duration) {
        slide.duration = stop;
        slide.stops = true;
    }
    if (const double t = slide.duration; !straight && !slide.stops && holds * t > speed) {
        // Friction that can reverse the motion within the piece uses the direction of the final velocity. With any
        // other direction, a slow point would move back and forth across the pull.
        const Vec3d pulled = vt + t * at;
        const double size = pulled.norm();
        slide.stops = size <= t * holds;
        slide.a = slide.stops ? Vec3d(-vt / t) : Vec3d(at - holds / size * pulled);
    } else if (!straight) {
        const Vec3d middle = vt + 0.5 * slide.duration * slide.a;
        if (const double size = middle.norm(); size > 0) slide.a = at - holds / size * middle;
    }
    return slide;
}

Parabola relaxed(const Vec3d& v, const Vec3d& a, double k, double t)
{
    if (!(t > 0)) return {v, a};
    const Propagator by = respond(k, 0, t);
    const Vec3d travel = by.x_of_v * v + by.x_of_G * a, end = by.v_of_v * v + by.v_of_G * a;
    const Vec3d begin = 2 / t * travel - end;
    return {begin, (end - begin) / t};
}

// x - (n + n1) (n1·x) / (1 + n·n1), for n·x = 0.
Vec3d transported(const Vec3d& x, const Vec3d& n, const Vec3d& n1)
{
    const double cosine = n.dot(n1);
    if (1 + cosine < parallel) return x - n1.dot(x) * n1;
    return x - n1.dot(x) / (1 + cosine) * (n + n1);
}

Vec3d edge_of(const Support& A, const Support& B)
{
    const Vec3d along = A.n.cross(B.n);
    const double sine = along.norm();
    return sine > parallel ? Vec3d(along / sine) : Vec3d(Vec3d::Zero());
}

// a = -NA nA - NB nB + (a·e) e, so with c = nA·nB, gA = -a·nA, gB = -a·nB:
//
//   NA = (gA - c gB) / (1 - c²),   NB = (gB - c gA) / (1 - c²)
//
// and friction takes up to μA NA + μB NB along e.
Slide slide_along(const Support& A, const Support& B, const Vec3d& v, const Vec3d& pull, double left, int& lifted)
{
    const Vec3d e = edge_of(A, B), a = pull - A.ac;
    const double c = A.n.dot(B.n), gA = -a.dot(A.n), gB = -(pull - B.ac).dot(B.n);
    const double sine2 = (1 - c) * (1 + c);
    const double NA = (gA - c * gB) / sine2, NB = (gB - c * gA) / sine2;
    lifted = -1;
    if (NA < -A.adhesion || NB < -B.adhesion) {
        lifted = NA + A.adhesion < NB + B.adhesion ? 0 : 1;
        return {Slide::Leaves};
    }

    const double drive = a.dot(e), holds = A.friction * std::max(NA, 0.0) + B.friction * std::max(NB, 0.0);
    const double speed = (v - A.vc).dot(e);
    if (speed == 0) {
        if (std::abs(drive) <= holds + rounding * a.norm()) return {Slide::Sticks};
        return {Slide::Moves, (drive - std::copysign(holds, drive)) * e, left};
    }
    const double along = drive - std::copysign(holds, speed);
    Slide slide{Slide::Moves, along * e, left};
    const double stop =
        along * speed < 0 ? time_to_stop(std::abs(speed), -std::abs(along), A.viscosity + B.viscosity) : never;
    if (holds > 0 && stop <= left) {
        slide.duration = stop;
        slide.stops = true;
    }
    return slide;
}

}  // namespace rapid
