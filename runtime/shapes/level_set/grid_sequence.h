// Grids that change with time: a .vdb file for each frame, or for some of them; between two files a value goes on a
// straight line in time.
//
// A file is read when a frame next to it is first needed, and the few most recent ones are kept.
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

#include "runtime/frame_sequence.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {

// The files of a sequence, and which of them hold at a frame.
struct SequenceFiles {
    std::map<int, std::filesystem::path> files;  // by frame; at least one
    FrameSequence order = {};                    // what is beyond them; its ends are not used

    // From a whole frame to the next: the part of the way from file a to file b at its beginning and at its end.
    // Without a or b there is nothing at that end.
    struct Interval {
        std::optional<int> a, b;
        double begin = 0, end = 1;
    };
    Interval interval(std::int64_t frame) const;

    // The frame of the sequence, from its first to its last, that holds at a frame of the scene.
    std::optional<int> frame_of(std::int64_t frame) const;
};

// G: VectorGrid or DensityGrid.
template <class G>
class GridSequence final : public Object {
public:
    using Grid = std::shared_ptr<const G>;

    // read: from any thread.
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
        Grid a, b;  // null where there is nothing
        double begin, end;
    };
    // From a whole frame to the next. From any thread. Error: of a file.
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
        for (const auto& [number, grid] : kept_)
            if (number == *frame) return grid;
        kept_.emplace_front(*frame, read_(files_.files.at(*frame)));
        if (kept_.size() > most_kept) kept_.pop_back();
        return kept_.front().second;
    }

    static constexpr std::size_t most_kept = 4;  // two for the frame, two that the next begins with

    SequenceFiles files_;
    std::function<Grid(const std::filesystem::path&)> read_;
    mutable std::mutex mutex_;
    mutable std::deque<std::pair<int, Grid>> kept_;  // most recent first
};

}  // namespace rapid
