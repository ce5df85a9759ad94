// Parts of a run, which were simulated apart (docs/scale.md), as one: to the bit what the whole run would have written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "scene.h"

namespace rapid {

// What merge_files() has written.
struct MergedFiles {
    std::size_t parts = 0, frames = 0;  // that were read, of each part; that were written
    std::uint64_t points = 0;           // of all frames
};

// Puts the files of the parts of a run together, a frame at a time; the points of a large frame lie in unnamed files
// beside the output meanwhile. Loops run where the caller's do, in the TBB arena of the calling thread.
//
// parts: patterns of the files of each part, as its run had them; {part} stands for all parts whose records are there.
// output: the pattern of the whole, #### is the frame's number; missing folders are made.
// progress: told of each frame that is written, with its points; false ends the merge with the error Cancelled.
//
// Errors: WrongCall, before anything is written: a part or a frame that is missing or of another run, each of them; a
// format that holds no points; an output that would replace a part. FailedFrame: a file that can't be read or written,
// a point that belongs to another part; frames before it are written. Busy: another thread merges. OutOfMemory and
// Unexpected at any time. Meanwhile no scene may run and no frame be read or copied, whose points would lie in those
// files, too.
Result<MergedFiles> merge_files(const std::vector<std::string>& parts, const std::string& output,
                                const std::function<bool(std::int64_t frame, std::uint64_t points)>& progress = {});

}  // namespace rapid
