// What the options of rapid/run.h mean for the files of a run.
#pragma once

#include "bindings/run/frame_files.h"
#include "include/rapid/run.h"

namespace rapid {

// Error: a size or an angle that can't be; an output that is none.
FrameFiles frame_files(const FileOutputs& files);

// Error: frames that do not go up, or that no file's name or format holds.
void check_frames(const RunFrames& frames);

}  // namespace rapid
