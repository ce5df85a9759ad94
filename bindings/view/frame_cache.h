// Frames in a folder (`rapid view --cache`): those that memory has no room for, and those that a later view of the same
// scene finds again.
//
// A run's frames lie in a folder named by its fingerprint: a file a frame, a file a set of shapes, snapshots from which
// the run goes on, and an index of a line a frame. Files have their names when they are complete, so that what the
// index names and is there is whole. The runs used last are kept, and others removed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "bindings/view/frame_store.h"
#include "runtime/files/file_error.h"
#include "runtime/files/file_writer.h"

namespace rapid {

// The frames of one run.
class CachedRun : public FrameSource {
public:
    // What is there of it, of which the scene reads the same files still. hash: of its fingerprint. Error: the folder
    // can't be made or read.
    CachedRun(std::filesystem::path folder, std::string hash, Scene& scene);

    struct Known {
        std::string statistics;
        std::vector<std::string> warnings;
        std::int64_t shapes = 0;  // the number of their file; 0: none
    };
    // The frames that were there at the beginning.
    const std::map<std::int64_t, Known>& known() const { return known_; }

    // Writes a frame, unless it is known; waits while two others are being written. read: the files that were read for
    // it (Scene::take_inputs).
    void put(const ViewFrame& frame, const std::vector<std::string>& warnings,
             const std::map<std::string, std::string>& read);
    void keep(const SceneSnapshot& snapshot);
    // Waits until all is written.
    void finish() { writer_.finish(); }
    // The latest one before a frame that is whole.
    std::optional<SceneSnapshot> snapshot_before(std::int64_t frame) const;

    bool has(std::int64_t number) const override;
    ViewFramePtr load(std::int64_t number, std::uint64_t run) override;

    // Why files could not be written, since the last call.
    std::vector<std::string> take_failures() { return writer_.take_failures(); }

private:
    std::filesystem::path file(const char* what, std::int64_t number) const;
    void read_index(Scene& scene);
    std::int64_t number_of(const SceneShapes& shapes);
    SceneShapes shapes(std::int64_t number);

    const std::filesystem::path folder_;
    const std::string hash_;
    std::map<std::int64_t, Known> known_;
    Descriptor index_;
    mutable std::mutex mutex_;                    // of what follows
    std::map<std::int64_t, std::int64_t> there_;  // frames with the numbers of their shapes
    std::int64_t last_shapes_ = 0;
    SceneShapes written_, loaded_;  // the last ones
    std::int64_t written_number_ = 0, loaded_number_ = 0;
    FileWriter writer_{"file"};
};

class FrameCache {
public:
    // Error: the folder can't be made, or another process has it.
    explicit FrameCache(const std::filesystem::path& folder);

    std::shared_ptr<CachedRun> open(Scene& scene);

private:
    void remove_old() const;

    const std::filesystem::path folder_;
    Descriptor lock_;
};

}  // namespace rapid
