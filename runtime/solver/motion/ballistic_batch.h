// Advances points on which only one uniform acceleration and one linear drag act: from single precision to single
// precision in one pass over memory, whatever the sub-steps, because the closed form is exact and they would only
// repeat it. Points that may come near a shape are left as they are, for Collisions.
//
// Why beside the sub-steps of a block (solver/block_step.h): it runs at the speed of memory (bench_solver, free_fall).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/column.h"
#include "runtime/simd.h"
#include "runtime/solver/motion/packed_points.h"
#include "runtime/vec.h"

namespace rapid {

// How long each point moves in the frame, s: by its own column, which is shorter for a newborn, or h.
struct OwnTime {
    double h = 0;
    Strided<float> own{nullptr, 0};  // null where all move for h

    // The whole frame in double precision, whether or not the points have a column because of newborns.
    double operator()(std::size_t i) const
    {
        if (!own.data || own[i] == static_cast<float>(h)) return h;
        return own[i];
    }
};

class BallisticBatch {
public:
    // v' = g - k v: m/s², 1/s.
    BallisticBatch(const Vec3d& g, double k);

    // Points whose path may come within `radius` of the box, by their bounding boxes, are not advanced.
    void avoid(const Box3d& box, double radius);

    struct Progress {
        std::size_t end;  // the points before it have been advanced, or left to Collisions
        bool finite;      // whether all their states are finite
    };

    // Advances the points [begin, end), up to the first block of which one is not finite. Those that are left as they
    // are, are appended to `near`, in order.
    Progress advance(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin, std::size_t end,
                     std::vector<std::uint32_t>& near) const;

private:
    // A widened box, repeated along the coordinates of eight points.
    struct Limits {
        PackedPoints<Doubles> min, max;
    };

    // The propagator of each of eight points: how long it moves, s; with drag also the factors of its velocity, and
    // what the acceleration adds to its position, m, and to its velocity, m/s.
    struct Propagators {
        PackedPoints<Doubles> t, x_of_v, v_of_v, fallen, gained;
    };

    // The propagators of one pack of points after the other: most points move for the whole frame, and share them.
    class Clock {
    public:
        Clock(const BallisticBatch& batch, const OwnTime& time, std::size_t begin);
        // Of n points.
        const Propagators& of(std::size_t first, std::size_t n)
        {
            if (own_) set(first, n);
            return propagators_;
        }

    private:
        void set(std::size_t first, std::size_t n);

        const BallisticBatch& batch_;
        const OwnTime& time_;
        const float* own_;        // null where all move for the same time
        bool is_of_whole_frame_;  // propagators_
        Propagators propagators_;
    };

    // The bounding box of some vectors, and whether all of them are finite; where they are not, the box means nothing.
    struct Bounds {
        Box3d box;
        bool finite;
    };
    // The largest magnitude that was written, as bits; by coordinate.
    using Largest = PackedPoints<FloatFlags>;

    static Bounds bounds_of(std::span<const Vec3f> values);
    static Progress progress(std::size_t end, const Largest& largest);
    void set_propagator(Propagators& all, std::uint32_t point, double t) const;
    bool are_far(const Box3d& positions, const Box3d& velocities, double t) const;

    template <bool Dragged, bool Avoids, bool Checks>
    std::uint32_t advance_pack(float* P, float* v, const Propagators& by, Largest& largest) const;
    template <bool Dragged, bool Avoids, bool Checks>
    void advance_block(std::span<Vec3f> P, std::span<Vec3f> v, Clock& clock, std::size_t begin, std::size_t end,
                       Largest& largest, std::vector<std::uint32_t>* near) const;
    template <bool Dragged, bool Avoids>
    Progress advance_all(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin,
                         std::size_t end, std::vector<std::uint32_t>& near) const;

    Vec3d g_;
    double k_;
    PackedPoints<Doubles> packed_g_;
    std::vector<Box3d> boxes_;    // widened
    std::vector<Limits> limits_;  // of the boxes
};

}  // namespace rapid
