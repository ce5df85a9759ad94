// Points that may come near one plane at rest and nothing else, many at once: where they miss it, bounce off it once,
// or lie on it and nothing but friction changes their way. Most points that touch anything do one of these. Without
// branches, so that the loop is over vectors; what a Collisions::Traveller would do, at a twentieth of its cost.
//
// Layout: structure of arrays; coordinates are shape [3, many].
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/shapes/shape.h"

namespace rapid {

struct PlanePass {
    static constexpr std::size_t many = 64;
    enum Kind : std::int64_t { More, Misses, Lies, Bounces };  // More: there is more to it

    bool is_full() const { return size == many; }
    // i: its place in the block. a: m/s², constant. dt: s.
    void add(std::uint32_t i, const Vec3d& P, const Vec3d& v, const Vec3d& a, double dt, double radius, double bounce,
             double friction);

    // Takes all through their steps.
    void solve(const HalfSpace& plane);

    // Those that bounce or lie, and may come near this box with what is known of their radius, have more to it.
    void leave_out_near(const Box3d& box, double radius);

    std::size_t size = 0;
    std::uint32_t place[many];
    std::int64_t kind[many];
    double left[many], approach[many];  // of a bounce: s after it; m/s

    Vec3d end(std::size_t j) const { return at(end_, j); }         // m
    Vec3d velocity(std::size_t j) const { return at(v_end_, j); }  // m/s, at the end
    Vec3d from(std::size_t j) const { return at(from_, j); }       // where it bounces, or lies at first
    Vec3d change(std::size_t j) const { return at(change_, j); }   // of the velocity by the bounce, m/s

private:
    using Coordinates = double[3][many];
    static Vec3d at(const Coordinates& x, std::size_t j) { return {x[0][j], x[1][j], x[2][j]}; }

    Coordinates P_, v_, a_, end_, v_end_, from_, change_;
    Coordinates sagging_;  // how far the way is off the straight line to its end at most, m
    double dt_[many], radius_[many], bounce_[many], friction_[many];
};

}  // namespace rapid
