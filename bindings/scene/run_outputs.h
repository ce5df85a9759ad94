// What the options of rapid/run.h mean for the files of a run.
#pragma once

#include "bindings/run/frame_files.h"
#include "include/rapid/run.h"

namespace rapid {

// Throws a Refusal: a size or an angle that can't be. Error: an output that is none.
FrameFiles frame_files(const FileOutputs& files);

// Throws a Refusal: frames that do not go up, or that no file's name or format holds.
void check_frames(const RunFrames& frames);

}  // namespace rapid
