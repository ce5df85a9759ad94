// A frame's data in `--cache` besides snapshots: its statistics and warnings, and the files that it has written.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bindings/run/fingerprint.h"
#include "runtime/picture/picture_fit.h"
#include "runtime/report/statistics.h"

namespace rapid {

// A written file, in its state at that time.
struct WrittenFile {
    std::string path, how;  // absolute; how it is made (FrameFiles)
    bool of_node = false;   // a `:write`
    std::uint64_t bytes = 0;
    std::int64_t modified = 0;  // ns
    std::optional<PictureFit> fit;

    // Takes bytes and modified from the file. Returns false if it does not exist.
    bool look();
    // Returns true if it exists and is unchanged.
    bool is_whole() const;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(path, how, of_node, bytes, modified, fit);
    }
};

struct FrameRecord {
    FrameFigures statistics;
    std::vector<std::string> warnings;
    Fingerprint read;              // contents of files since the previous frame
    double seconds = 0;            // of the run, until this frame's files were written
    std::uint64_t peak_bytes = 0;  // likewise
    std::vector<WrittenFile> files;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(statistics, warnings, read, seconds, peak_bytes, files);
    }
};

}  // namespace rapid
