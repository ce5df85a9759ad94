// The names of a run's settings in messages. The library uses neutral names, those of the members of SceneOptions and
// RunOptions. A program whose users know them by other names, such as the command's options, provides these.
#pragma once

#include <map>
#include <string>

namespace rapid {

enum class Setting {
    Memory,
    ScriptMemory,
    ScriptSeconds,
    Value,  // of a parameter
    Seed,
    EstimateErrors,
    Output,
    Frames,
    PictureSize,
    Statistics,
    Profile,
    Events,
    Cache,
    CacheAgain,
    Part,
    Parts,
    Sample,
};

const std::string& name_of(Setting setting);

// Names for the whole process, given before anything else runs; settings that are left out keep the neutral ones.
void name_settings(const std::map<Setting, std::string>& names);

}  // namespace rapid
