// The frames that a viewer has: what a run publishes and the page asks for.
//
// Frames of the run before stay, as stale ones, until the new run's take their places: what is seen never vanishes.
// A published frame never changes; its columns are shared with the run where they are the same. Where a run has a
// source of its frames (frame_cache.h), memory holds those that were used last.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"

namespace rapid {

struct ViewFrame {
    std::int64_t number;
    std::uint64_t run;       // of which it is
    SceneFrame points;       // of all outputs
    std::string statistics;  // JSON, as in a statistics file
    SceneShapes shapes = {};
    std::size_t bytes = 0;
};
using ViewFramePtr = std::shared_ptr<const ViewFrame>;

// Of the points, and of the shapes in part: meshes are mostly shared.
std::size_t bytes_of(const ViewFrame& frame);

// Where frames are besides memory.
class FrameSource {
public:
    virtual ~FrameSource() = default;
    virtual bool has(std::int64_t number) const = 0;
    // Without statistics and bytes. Null: it is not there. Error: it can't be read.
    virtual ViewFramePtr load(std::int64_t number, std::uint64_t run) = 0;
};

class FrameStore {
public:
    // bytes: that the frames may take.
    explicit FrameStore(std::size_t bytes) : most_bytes_(bytes) {}

    // False where the frame does not fit: then it is not kept. Stale frames go first; then those that their source has.
    bool put(ViewFramePtr frame, std::shared_ptr<FrameSource> source = nullptr);
    // A frame that its source has.
    void add(std::int64_t number, std::uint64_t run, std::string statistics, std::shared_ptr<FrameSource> source);
    // Null where there is none. Error: it can't be read from its source.
    ViewFramePtr find(std::int64_t number);
    // All frames of a run that are in memory, in order.
    std::vector<ViewFramePtr> of_run(std::uint64_t run) const;
    // The statistics of a run's frames behind one, in order, and at most so many.
    std::vector<std::string> statistics(std::uint64_t run, std::int64_t after, std::size_t most) const;
    // Takes away what is not of the run.
    void keep_only(std::uint64_t run);

    // The first and last of each stretch of frames, of this run, and of those before it.
    struct Stretches {
        std::vector<std::pair<std::int64_t, std::int64_t>> fresh, stale;
    };
    Stretches stretches(std::uint64_t run) const;
    std::size_t bytes() const;
    std::size_t most_bytes() const { return most_bytes_; }

private:
    struct Entry {
        std::uint64_t run = 0;
        ViewFramePtr frame;  // null: its source has it
        std::string statistics;
        std::shared_ptr<FrameSource> source;  // may be null
        std::uint64_t used = 0;
    };
    bool make_room(std::size_t bytes, std::uint64_t run);
    void drop(Entry& entry);

    const std::size_t most_bytes_;
    mutable std::mutex mutex_;
    std::map<std::int64_t, Entry> frames_;
    std::size_t bytes_ = 0;
    std::uint64_t uses_ = 0;
};

}  // namespace rapid
