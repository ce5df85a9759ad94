// A scene for the solver alone: points, gravity and colliders, advanced frame by frame.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "runtime/shapes/analytic/analytic.h"
#include "runtime/solver/solve.h"
#include "tests/solver/motion/uniform_force.h"
#include "tests/test.h"

namespace rapid::test {

constexpr double g = 9.81;      // m/s^2
constexpr double h = 1.0 / 24;  // s, of a frame

// An acceleration that depends on position, velocity and time, evaluated at the middle of every substep.
template <class F>
class LocalForce : public Force {
public:
    explicit LocalForce(F f) : f_(std::move(f)) {}
    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        for (std::size_t i = 0; i < chunk.size(); ++i) forces.add(i, f_(chunk, i));
    }

private:
    F f_;
};

class Scene {
public:
    PointSet points;
    Dynamics dynamics;
    SolveOptions options;
    SleepRecords sleep_records;
    FrameFigures last;             // of the last frame
    std::uint64_t collisions = 0;  // over all frames
    double penetration_max = 0;    // over all frames, m

    explicit Scene(PointSet set) : points(std::move(set)) { options.h = 1.0 / 24; }

    Scene& gravity(const Vec3d& g = {0, -9.81, 0})
    {
        dynamics.add(std::make_shared<UniformForce>(g));
        return *this;
    }
    template <class F>
    Scene& force(F f)
    {
        auto made = std::make_shared<LocalForce<F>>(std::move(f));
        made->node = "push1";
        dynamics.add(std::move(made));
        return *this;
    }
    Scene& collide(ShapePtr shape, PerPoint<float> bounce = 0.5f, PerPoint<float> friction = 0.0f,
                   const std::string& group = "")
    {
        auto collider = std::make_shared<Collider>();
        collider->node = "collide1";
        collider->shape = std::move(shape);
        collider->bounce = std::move(bounce);
        collider->friction = std::move(friction);
        collider->group = group;
        dynamics.add(std::move(collider));
        return *this;
    }
    Scene& floor(float bounce = 0.5f, float friction = 0.0f)
    {
        return collide(make_plane({0, 1, 0}, 0), bounce, friction);
    }
    Scene& substeps(int n)
    {
        options.substeps = n;
        return *this;
    }
    Scene& frame_length(double h)
    {
        options.h = h;
        return *this;
    }

    // Makes points at rest sleep after this many seconds.
    Scene& sleep(double after = 0.25)
    {
        if (!points.has("still")) points.add({"still", 0.0f});
        options.sleep = after;
        options.sleep_records = &sleep_records;
        return *this;
    }

    Scene& run(int frames)
    {
        for (int f = 0; f < frames; ++f) {
            ++options.frame;
            options.time = static_cast<double>(options.frame) * options.h;
            last = solve(points, dynamics, options);
            collisions += last.collisions;
            penetration_max = std::max(penetration_max, last.penetration_max);
        }
        return *this;
    }

    Vec3d P(std::size_t i = 0) const { return std::as_const(points).P()[i].cast<double>(); }
    Vec3d v(std::size_t i = 0) const { return std::as_const(points).v()[i].cast<double>(); }
};

// Returns true if positions and velocities are bit-identical.
inline bool same_bits(const PointSet& a, const PointSet& b)
{
    return same_bits(a.P(), b.P()) && same_bits(a.v(), b.v());
}

}  // namespace rapid::test
