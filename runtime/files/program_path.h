// Where other programs are: ffmpeg, dot, those of Slurm.
#pragma once

#include <string>

namespace rapid {

// The first of this name on PATH; empty where there is none. Only in folders that PATH names from the root on: what
// lies in the current folder may have come with a scene of others.
std::string program_path(const std::string& name);

}  // namespace rapid
