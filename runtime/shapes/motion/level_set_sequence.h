// Level sets that change with time: a .vdb file for each frame, or for some of them; between two files distances go on
// straight lines in time (numerics.md, Level sets between files).
//
//   φ(x, t) = (1 - t) φ_a(x) + t φ_b(x),    velocity of the surface  v = -∂φ/∂t ∇φ / max(|∇φ|², 1/4)
//
// Both are widened until their bands overlap: by the farthest that the one surface is from the other. Where that is
// more than half of the size of both, or takes too many voxels, the sequence jumps: the later file holds.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "runtime/frame.h"
#include "runtime/shapes/level_set/grid_sequence.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/moving_body.h"

namespace rapid {

// A pair of level sets through an interval. Its material goes along the normals of the surface.
class BlendedLevelSets : public MovingBody {
public:
    virtual double voxel() const = 0;  // m
    virtual std::uint64_t active_voxels() const = 0;
    // The same with a band of at least `metres` in which distances are known at all times.
    virtual std::shared_ptr<const BlendedLevelSets> with_band(double metres) const = 0;
};

class LevelSetSequence final : public Object, public std::enable_shared_from_this<LevelSetSequence> {
public:
    static constexpr std::string_view param_type = "level set sequence";
    std::string_view kind() const override { return "level set sequence"; }
    bool varies() const override { return true; }

    using Read = std::function<LevelSetPtr(const std::filesystem::path&)>;
    // read: from any thread. name: the pattern, for messages.
    LevelSetSequence(SequenceFiles files, std::string name, Read read);

    // Through a part of the time from one whole frame to the next, in frames; times are in seconds since its beginning.
    // A LevelSet where nothing changes, else BlendedLevelSets; null where there is nothing at the end. From any
    // thread. Error: of a file.
    ShapePtr over(const FrameClock& clock, double from, double to) const;
    // The file of a whole frame; null where there is nothing. Error: of a file; there is none for this frame, but
    // others around it.
    LevelSetPtr at(std::int64_t frame) const;

private:
    // Level sets of two files, with such a band where the distances between them are known.
    struct Pair {
        LevelSetPtr a, b;
        double travel = 0;  // m, the farthest that the one surface is from the other
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

    // Of the last users, most recent first.
    struct Kept {
        int file;
        double band;  // m, that was asked for; 0 as read
        LevelSetPtr level_set;
    };
    mutable std::mutex mutex_;
    mutable std::deque<Kept> kept_;
    mutable std::map<std::pair<int, int>, Pair> pairs_;  // without level sets
};

using LevelSetSequencePtr = std::shared_ptr<const LevelSetSequence>;

// The pair through an interval of `duration` seconds, in which the part of b goes from begin to end. travel: m. tag:
// of the interval, from 0; its material is that of no interval with another. widen: for with_band().
struct BlendedInterval {
    LevelSetPtr a, b;
    double begin, end, duration, travel;
    std::int32_t tag;
    std::function<std::shared_ptr<const BlendedLevelSets>(double band)> widen;
};
std::shared_ptr<const BlendedLevelSets> blended_level_sets(BlendedInterval interval);

}  // namespace rapid
