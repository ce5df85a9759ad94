// Translates the options of rapid/run.h for the files of a run.
#pragma once

#include "bindings/run/frame_files.h"
#include "include/rapid/run.h"

namespace rapid {

// Throws Error if a size or an angle is not possible, or an output is invalid.
FrameFiles frame_files(const FileOutputs& files);

// Throws Error if frames do not increase, or do not fit into file names or formats.
void check_frames(const RunFrames& frames);

}  // namespace rapid
