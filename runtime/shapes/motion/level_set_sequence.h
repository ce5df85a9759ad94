// Time-dependent level sets: a .vdb file for every frame, or for some of them. Distances are interpolated linearly in
// time between two files (numerics.md, Level sets between files).
//
//   φ(x, t) = (1 - t) φ_a(x) + t φ_b(x),    velocity of the surface  v = -∂φ/∂t ∇φ / max(|∇φ|², 1/4)
//
// Both are widened until their bands overlap, that is, by the largest distance of one surface from the other. If that
// distance is more than half the size of the larger one, or needs too many voxels, the sequence jumps and the later
// file applies.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "runtime/base/frame.h"
#include "runtime/shapes/level_set/grid_sequence.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/moving_body.h"

namespace rapid {

// A pair of level sets during an interval. Its material moves along the normals of the surface.
class BlendedLevelSets : public MovingBody {
public:
    virtual double voxel() const = 0;  // m
    virtual std::uint64_t active_voxels() const = 0;
    // Returns the same with a band of at least `metres` in which distances are exact at all times.
    virtual std::shared_ptr<const BlendedLevelSets> with_band(double metres) const = 0;
};

class LevelSetSequence final : public Object, public std::enable_shared_from_this<LevelSetSequence> {
public:
    static constexpr std::string_view param_type = "level set sequence";
    std::string_view kind() const override { return "level set sequence"; }
    bool varies() const override { return true; }

    using Read = std::function<LevelSetPtr(const std::filesystem::path&)>;
    // read: must be thread-safe. name: the pattern, for messages.
    LevelSetSequence(SequenceFiles files, std::string name, Read read);

    // Returns the shape during a part of the time from one whole frame to the next, in frames; its times are in seconds
    // since the beginning of that part. The result is a LevelSet if nothing changes, BlendedLevelSets otherwise, and
    // null if there is no file at the end. Thread-safe. Throws Error if a file cannot be read.
    ShapePtr over(const FrameClock& clock, double from, double to) const;
    // Returns the level set of a whole frame, or null if the sequence has none there. Throws Error if the file cannot
    // be read, or is missing between others.
    LevelSetPtr at(std::int64_t frame) const;

private:
    // The level sets of two files, with the requested band around all intermediate surfaces.
    struct Pair {
        LevelSetPtr a, b;
        double travel = 0;  // m, largest distance of one surface from the other
        bool jumps = false;
    };
    Pair pair(int a, int b, double band) const;
    std::shared_ptr<const BlendedLevelSets> blend(const SequenceFiles::Interval& part, double duration,
                                                  std::int32_t tag, double band) const;
    LevelSetPtr read(int file) const;
    LevelSetPtr widened(int file, double band) const;

    SequenceFiles files_;
    std::string name_;
    Read read_;

    // Recently used level sets, most recent first.
    struct Recent {
        int file;
        double band;  // m, as requested; 0 as read
        LevelSetPtr level_set;
    };
    mutable std::mutex mutex_;
    mutable std::deque<Recent> recent_;
    mutable std::map<std::pair<int, int>, Pair> pairs_;  // without the level sets
};

using LevelSetSequencePtr = std::shared_ptr<const LevelSetSequence>;

// The pair during an interval of `duration` seconds, in which the weight of b changes from begin to end. travel: m.
// tag: identifies the interval, from 0; its material is valid in no interval with another tag. widen: for with_band().
struct BlendedInterval {
    LevelSetPtr a, b;
    double begin, end, duration, travel;
    std::int32_t tag;
    std::function<std::shared_ptr<const BlendedLevelSets>(double band)> widen;
};
std::shared_ptr<const BlendedLevelSets> blended_level_sets(BlendedInterval interval);

}  // namespace rapid
