// Time-dependent grids: a .vdb file for every frame, or for some of them. Between two files each value is interpolated
// linearly in time.
//
// Files are read when first needed, and the most recent few stay cached.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "runtime/base/frame_sequence.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {

// The files of a sequence, and their mapping to the scene's frames.
struct SequenceFiles {
    std::map<int, std::filesystem::path> files;  // by frame; at least one
    FrameSequence order = {};                    // behaviour beyond the files; its first and last frame are not used

    // From a whole frame to the next: the interpolation parameters between files a and b at its beginning and end. An
    // end without a or b has no grid.
    struct Interval {
        std::optional<int> a, b;
        double begin = 0, end = 1;
    };
    Interval interval(std::int64_t frame) const;

    // Returns the frame of the sequence, within its range, that a frame of the scene shows.
    std::optional<int> frame_of(std::int64_t frame) const;
};

// G: VectorGrid or DensityGrid.
template <class G>
class GridSequence final : public Object {
public:
    using Grid = std::shared_ptr<const G>;

    // read: must be thread-safe.
    GridSequence(SequenceFiles files, std::function<Grid(const std::filesystem::path&)> read)
        : files_(std::move(files)), read_(std::move(read))
    {
    }

    std::string_view kind() const override
    {
        return std::is_same_v<G, VectorGrid> ? "vector grid sequence" : "fog sequence";
    }
    bool varies() const override { return true; }

    struct Interval {
        Grid a, b;  // null if there is no grid
        double begin, end;
    };
    // Returns the grids from a whole frame to the next. Thread-safe. Throws Error if a file cannot be read.
    Interval over(std::int64_t frame) const
    {
        const SequenceFiles::Interval files = files_.interval(frame);
        return {grid_of(files.a), grid_of(files.b), files.begin, files.end};
    }

private:
    Grid grid_of(std::optional<int> frame) const
    {
        if (!frame) return nullptr;
        const std::lock_guard lock(mutex_);
        for (const auto& [number, grid] : recent_)
            if (number == *frame) return grid;
        recent_.emplace_front(*frame, read_(files_.files.at(*frame)));
        if (recent_.size() > max_recent) recent_.pop_back();
        return recent_.front().second;
    }

    static constexpr std::size_t max_recent = 4;  // two for this frame, two for the start of the next

    SequenceFiles files_;
    std::function<Grid(const std::filesystem::path&)> read_;
    mutable std::mutex mutex_;
    mutable std::deque<std::pair<int, Grid>> recent_;  // most recent first
};

}  // namespace rapid
