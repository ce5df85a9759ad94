// What messages call the settings of a run. The library has neutral names, those of the members of SceneOptions and
// RunOptions; a program whose users know them by others, as the command has options, gives these.
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
