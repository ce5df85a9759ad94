// Advances points that are subject only to one uniform acceleration and one linear drag. It works from single to
// single precision in one pass over memory for any number of substeps, because the closed form is exact and substeps
// would only repeat it. Points that may come near a shape are left unchanged, for Collisions.
//
// This exists alongside the substeps of a block (solver/block_step.h) because it runs at memory speed (bench_solver,
// free_fall).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/simd.h"
#include "runtime/math/vec.h"
#include "runtime/points/column.h"
#include "runtime/solver/motion/packed_points.h"

namespace rapid {

// The time that each point moves in the frame, s: from its own column, which is shorter for a newborn, or h.
struct OwnTime {
    double h = 0;
    Strided<float> own{nullptr, 0};  // null if all points move for h

    // Returns the whole frame in double precision, whether or not newborns make a column necessary.
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

    // Excludes points whose path may come within `radius` of the box, by their bounding boxes.
    void avoid(const Box3d& box, double radius);

    struct Progress {
        std::size_t end;  // the points before it were advanced, or left to Collisions
        bool finite;      // all their states are finite
    };

    // Advances the points [begin, end), up to the first block with a non-finite point. Appends the excluded points to
    // `near`, in order.
    Progress advance(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin, std::size_t end,
                     std::vector<std::uint32_t>& near) const;

private:
    // A widened box, repeated along the coordinates of eight points.
    struct Limits {
        PackedPoints<Doubles> min, max;
    };

    // The propagators of eight points: the time of motion, s; with drag also the factors of the velocity, and the
    // contributions of the acceleration to position, m, and velocity, m/s.
    struct Propagators {
        PackedPoints<Doubles> t, x_of_v, v_of_v, fallen, gained;
    };

    // Supplies the propagators for consecutive packs of points. Most points move for the whole frame and share them.
    class Clock {
    public:
        Clock(const BallisticBatch& batch, const OwnTime& time, std::size_t begin);
        // Returns the propagators of n points.
        const Propagators& of(std::size_t first, std::size_t n)
        {
            if (own_) set(first, n);
            return propagators_;
        }

    private:
        void set(std::size_t first, std::size_t n);

        const BallisticBatch& batch_;
        const OwnTime& time_;
        const float* own_;        // null if all points move for the same time
        bool is_of_whole_frame_;  // propagators_ are for the whole frame
        Propagators propagators_;
    };

    // The bounding box of some vectors, and a flag that all of them are finite. If not, the box is meaningless.
    struct Bounds {
        Box3d box;
        bool finite;
    };
    // The largest magnitude written, as bits, by coordinate.
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
