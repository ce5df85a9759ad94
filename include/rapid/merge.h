// Merges the parts of a run that were simulated separately (docs/scale.md). The result is bit-identical to that of the
// whole run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "scene.h"

namespace rapid {

// The result of merge_files().
struct MergedFiles {
    std::size_t parts = 0, frames = 0;  // read, of each part; written
    std::uint64_t points = 0;           // of all frames
};

// Merges the files of the parts of a run, a frame at a time. Meanwhile the points of a large frame are stored in
// unnamed files next to the output. Loops run in the TBB arena of the calling thread.
//
// parts: patterns of the files of each part, as in its run; {part} stands for all parts whose records exist.
// output: the pattern of the whole, where #### is the frame's number; missing folders are made.
// progress: called with each frame that is written and its points; false ends the merge with the error Cancelled.
//
// Fails with WrongCall, before anything is written, if a part or a frame is missing or belongs to another run (each is
// listed), if a format holds no points, or if an output would replace a part. Fails with FailedFrame if a file cannot
// be read or written, or if a point belongs to another part; earlier frames are written. Fails with Busy if another
// thread merges, and with OutOfMemory or Unexpected at any time. Meanwhile no scene may run and no frame may be read or
// copied, since its points would be stored in those files, too.
Result<MergedFiles> merge_files(const std::vector<std::string>& parts, const std::string& output,
                                const std::function<bool(std::int64_t frame, std::uint64_t points)>& progress = {});

}  // namespace rapid
