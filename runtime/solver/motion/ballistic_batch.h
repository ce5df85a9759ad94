// Points that one acceleration moves, and one drag, and nothing else: from single precision to single precision in one
// go, whatever the sub-steps, because the closed form is exact and they would only repeat it. Points whose way may come
// near a shape are left as they are, for Collisions.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/column.h"
#include "runtime/vec.h"

namespace rapid {

// How long each point moves in the frame, s: by its own column, which a newborn's age has made shorter, or h.
struct OwnTime {
    double h = 0;
    Strided<float> own{nullptr, 0};  // null where all move for h

    // The whole frame in double, whether or not newborn points make a column of it.
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

    // No point is advanced that may come within `radius` of the box on its way, or has begun there: by the box around
    // its path, and with what rounding a position to single precision can do.
    void avoid(const Box3d& box, double radius);

    struct Progress {
        std::size_t end;  // how far it came
        bool finite;      // whether all states up to there are
    };

    // Advances the points [begin, end), up to the first few of which one is not finite. Those that are left as they
    // are, are appended to `near`, in order.
    Progress advance(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin, std::size_t end,
                     std::vector<std::uint32_t>& near) const;

private:
    // What belongs to the axes recurs along the packed coordinates: in whole vectors of 8, and whole points.
    static constexpr int period = 24, points_a_period = period / 3;
    using Period = std::array<double, period>;

    struct Limits {
        Period least, most;
    };

    // How long the points of a period move; with drag also what becomes of their velocities in this time, and what the
    // acceleration adds: to their places, m, and to their velocities, m/s.
    struct Times {
        Period t, x_of_v, v_of_v, fallen, gained;
    };

    // The times of one period after another: most points move for the whole frame, and share them.
    class Clock {
    public:
        Clock(const BallisticBatch& fall, const OwnTime& time, std::size_t begin);
        // Of n points.
        const Times& of(std::size_t first, std::size_t n)
        {
            if (own_) set(first, n);
            return times_;
        }

    private:
        void set(std::size_t first, std::size_t n);

        const BallisticBatch& fall_;
        const OwnTime& time_;
        const float* own_;  // null where all move for the same time
        bool of_h_;         // whether times_ are of the whole frame
        Times times_;
    };

    // The box around some vectors, and whether all of them are finite; where they are not, the box means nothing.
    struct Extent {
        Box3d box;
        bool finite;
    };

    static Period by_axis(const Vec3d& x);
    static Extent extent_of(std::span<const Vec3f> values);
    static Progress progress(std::size_t end, const std::uint32_t* largest);
    void set_times(Times& times, int point, double t) const;
    bool are_far(const Box3d& places, const Box3d& speeds, double t) const;
    template <bool Dragged, bool Avoids, bool Checks, class Near>
    void advance_period(float* P, float* v, const Times& times, std::uint32_t* largest, const Near& near) const;
    template <bool Dragged, bool Avoids, bool Checks, class Near>
    void advance_block(std::span<Vec3f> P, std::span<Vec3f> v, Clock& clock, std::size_t begin, std::size_t end,
                       std::uint32_t* largest, const Near& near) const;
    template <bool Dragged, bool Avoids>
    Progress advance_all(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin,
                         std::size_t end, std::vector<std::uint32_t>& near) const;
    template <bool Avoids>
    Progress advance_any(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin,
                         std::size_t end, std::vector<std::uint32_t>& near) const;

    Period g_;
    double k_;
    std::vector<Box3d> boxes_;    // widened
    std::vector<Limits> limits_;  // of these
};

}  // namespace rapid
