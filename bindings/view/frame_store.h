// The frames of a viewer: a run publishes them, and the page requests them.
//
// Frames of the previous run stay as stale ones until those of the new run replace them, so that the picture never
// vanishes. A published frame never changes; it shares unchanged columns with the run. With `--cache` a run's frames
// are also stored in a folder named by the run's fingerprint: memory holds the most recently used ones, and a later
// view of the same scene finds all of them. The folders of the most recent runs are kept, and others removed.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"
#include "runtime/files/frame_archive.h"

namespace rapid {

struct ViewFrame {
    std::int64_t number;
    std::uint64_t run;       // the run to which it belongs
    SceneFrame points;       // of all outputs
    std::string statistics;  // JSON, as in a statistics file
    SceneShapes shapes = {};
    std::size_t bytes = 0;
};
using ViewFramePtr = std::shared_ptr<const ViewFrame>;

// Counts the points and part of the shapes, since meshes are mostly shared.
std::size_t bytes_of(const ViewFrame& frame);

// The frames of one run in a folder. A record of its journal is JSON: "frame", "shapes" (the number of their file, 0
// for none), "statistics", "warnings" and "read", the files that were read for the frame.
class CachedRun {
public:
    // Finds the complete frames before the first one for which the scene read a file that has changed. `hash` is that
    // of the run's fingerprint. Throws Error if the folder cannot be made or read.
    CachedRun(const std::filesystem::path& folder, std::string hash, Scene& scene);

    struct Known {
        std::string statistics;
        std::vector<std::string> warnings;
        std::int64_t shapes = 0;  // the number of their file; 0: none
    };
    // Frames that existed at the beginning.
    const std::map<std::int64_t, Known>& known() const { return known_; }

    // Writes a frame unless it exists; waits while two others are being written. read: the files that were read for it
    // (Scene::take_inputs).
    void put(const ViewFrame& frame, const std::vector<std::string>& warnings,
             const std::map<std::string, std::string>& read);
    void keep(const SceneSnapshot& snapshot);
    // Waits until everything is written.
    void finish() { archive_.finish(); }
    // Returns the latest complete snapshot before a frame.
    std::optional<SceneSnapshot> snapshot_before(std::int64_t frame) const;

    bool has(std::int64_t number) const;
    // Returns a frame without statistics and bytes, or null if it does not exist. Throws Error if it cannot be read.
    ViewFramePtr load(std::int64_t number, std::uint64_t run);

    // Returns the reasons why files could not be written, since the last call.
    std::vector<std::string> take_failures() { return archive_.take_failures(); }

private:
    // Returns the records of the known frames.
    std::vector<std::string> read_journal(Scene& scene);
    std::int64_t number_of(const SceneShapes& shapes);
    SceneShapes shapes(std::int64_t number);

    const std::string hash_;
    FrameArchive archive_;
    std::map<std::int64_t, Known> known_;
    mutable std::mutex mutex_;                    // guards the members below and the journal
    std::map<std::int64_t, std::int64_t> there_;  // frames with the numbers of their shapes
    std::int64_t last_shapes_ = 0;
    SceneShapes written_, loaded_;  // the most recent ones
    std::int64_t written_number_ = 0, loaded_number_ = 0;
};

class FrameCache {
public:
    // Throws Error if the folder cannot be made, or if another process has it.
    explicit FrameCache(const std::filesystem::path& folder);

    std::shared_ptr<CachedRun> open(Scene& scene);

private:
    void remove_old() const;

    const std::filesystem::path folder_;
    const Descriptor lock_;
};

class FrameStore {
public:
    // bytes: capacity for frames.
    explicit FrameStore(std::size_t bytes) : most_bytes_(bytes) {}

    // Stores a frame. Returns false if it does not fit. Stale frames are evicted first, then those that the cache has.
    bool put(ViewFramePtr frame, std::shared_ptr<CachedRun> cache = nullptr);
    // Adds a frame that its cache has.
    void add(std::int64_t number, std::uint64_t run, std::string statistics, std::shared_ptr<CachedRun> cache);
    // Returns null if the frame does not exist. Throws Error if its cache cannot be read.
    ViewFramePtr find(std::int64_t number);
    // Returns all frames of a run that are in memory, in order.
    std::vector<ViewFramePtr> frames_of_run(std::uint64_t run) const;
    // Returns the statistics of at most `most` frames of a run after a frame, in order.
    std::vector<std::string> statistics(std::uint64_t run, std::int64_t after, std::size_t most) const;
    // Removes the frames of other runs.
    void keep_only(std::uint64_t run);

    // First and last frames of contiguous ranges: of this run, and of earlier ones.
    struct Stretches {
        std::vector<std::pair<std::int64_t, std::int64_t>> fresh, stale;
    };
    Stretches stretches(std::uint64_t run) const;
    std::size_t bytes() const;
    std::size_t most_bytes() const { return most_bytes_; }

private:
    struct Entry {
        std::uint64_t run = 0;
        ViewFramePtr frame;  // null if only its cache has it
        std::string statistics;
        std::shared_ptr<CachedRun> cache;  // may be null
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
