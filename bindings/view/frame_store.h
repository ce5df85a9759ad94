// The frames that a viewer has: what a run publishes and the page asks for.
//
// Frames of the run before stay, as stale ones, until the new run's take their places: what is seen never vanishes.
// A published frame never changes; its columns are shared with the run where they are the same. With `--cache` a run's
// frames lie in a folder, too, which is named by its fingerprint: memory holds those that were used last, and a later
// view of the same scene finds all of them. The runs used last are kept, and others removed.
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
    std::uint64_t run;       // of which it is
    SceneFrame points;       // of all outputs
    std::string statistics;  // JSON, as in a statistics file
    SceneShapes shapes = {};
    std::size_t bytes = 0;
};
using ViewFramePtr = std::shared_ptr<const ViewFrame>;

// Of the points, and of the shapes in part: meshes are mostly shared.
std::size_t bytes_of(const ViewFrame& frame);

// The frames of one run in a folder. A record of its journal is JSON: "frame", "shapes" (the number of their file, 0
// for none), "statistics", "warnings" and "read", the files that were read for the frame.
class CachedRun {
public:
    // Finds the frames that are whole, and for which the scene reads the same files still. `hash` is that of the run's
    // fingerprint. Throws Error if the folder can't be made or read.
    CachedRun(const std::filesystem::path& folder, std::string hash, Scene& scene);

    struct Known {
        std::string statistics;
        std::vector<std::string> warnings;
        std::int64_t shapes = 0;  // the number of their file; 0: none
    };
    // The frames that were there at the beginning.
    const std::map<std::int64_t, Known>& known() const { return known_; }

    // Writes a frame unless it is there; waits while two others are being written. read: the files that were read for
    // it (Scene::take_inputs).
    void put(const ViewFrame& frame, const std::vector<std::string>& warnings,
             const std::map<std::string, std::string>& read);
    void keep(const SceneSnapshot& snapshot);
    // Waits until all is written.
    void finish() { archive_.finish(); }
    // The latest one before a frame that is whole.
    std::optional<SceneSnapshot> snapshot_before(std::int64_t frame) const;

    bool has(std::int64_t number) const;
    // Without statistics and bytes. Null: it is not there. Error: it can't be read.
    ViewFramePtr load(std::int64_t number, std::uint64_t run);

    // Why files could not be written, since the last call.
    std::vector<std::string> take_failures() { return archive_.take_failures(); }

private:
    // Returns the records of the frames that are known.
    std::vector<std::string> read_journal(Scene& scene);
    std::int64_t number_of(const SceneShapes& shapes);
    SceneShapes shapes(std::int64_t number);

    const std::string hash_;
    FrameArchive archive_;
    std::map<std::int64_t, Known> known_;
    mutable std::mutex mutex_;                    // of what follows, and of the journal
    std::map<std::int64_t, std::int64_t> there_;  // frames with the numbers of their shapes
    std::int64_t last_shapes_ = 0;
    SceneShapes written_, loaded_;  // the last ones
    std::int64_t written_number_ = 0, loaded_number_ = 0;
};

class FrameCache {
public:
    // Error: the folder can't be made, or another process has it.
    explicit FrameCache(const std::filesystem::path& folder);

    std::shared_ptr<CachedRun> open(Scene& scene);

private:
    void remove_old() const;

    const std::filesystem::path folder_;
    const Descriptor lock_;
};

class FrameStore {
public:
    // bytes: that the frames may take.
    explicit FrameStore(std::size_t bytes) : most_bytes_(bytes) {}

    // False where the frame does not fit: then it is not kept. Stale frames go first; then those that the cache has.
    bool put(ViewFramePtr frame, std::shared_ptr<CachedRun> cache = nullptr);
    // A frame that its cache has.
    void add(std::int64_t number, std::uint64_t run, std::string statistics, std::shared_ptr<CachedRun> cache);
    // Null where there is none. Error: it can't be read from its cache.
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
        ViewFramePtr frame;  // null: its cache has it
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
