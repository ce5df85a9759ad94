// Finds other programs: ffmpeg, dot, those of Slurm.
#pragma once

#include <string>

namespace rapid {

// Returns the first program of this name on PATH, or an empty path. Only absolute folders are searched: a program in
// the current folder may have come with a downloaded scene.
std::string program_path(const std::string& name);

}  // namespace rapid
