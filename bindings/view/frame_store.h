// The frames that a viewer has: what a run publishes and the page asks for.
//
// Frames of the run before stay, as stale ones, until the new run's take their places: what is seen never vanishes.
// A published frame never changes; its columns are shared with the run where they are the same.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "runtime/picture/scene.h"
#include "runtime/points/point_set.h"

namespace rapid {

struct ViewFrame {
    std::int64_t number = 0;
    std::uint64_t run = 0;                    // of which it is
    std::map<std::string, PointSet> outputs;  // by name
    std::string statistics;                   // JSON, as in a statistics file
    std::shared_ptr<const PictureScene> scene;
    std::size_t bytes = 0;
};
using ViewFramePtr = std::shared_ptr<const ViewFrame>;

class FrameStore {
public:
    // bytes: that the frames may take.
    explicit FrameStore(std::size_t bytes) : most_bytes_(bytes) {}

    // False where the frame does not fit: then it is not kept. Stale frames go first.
    bool put(ViewFramePtr frame);
    ViewFramePtr find(std::int64_t number) const;
    // All frames of a run, in order.
    std::vector<ViewFramePtr> of_run(std::uint64_t run) const;
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
    const std::size_t most_bytes_;
    mutable std::mutex mutex_;
    std::map<std::int64_t, ViewFramePtr> frames_;
    std::size_t bytes_ = 0;
};

}  // namespace rapid
