// The options that all commands share which open a scene, and how it is opened.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "bindings/command_line/command.h"
#include "include/rapid/scene.h"

namespace rapid {

class SceneArguments {
public:
    void declare(Options& options);

    const std::string& file() const { return file_; }
    const std::optional<std::uint64_t>& seed() const { return options_.seed; }
    // --set, by name.
    const std::map<std::string, std::string>& settings() const { return settings_; }
    // --script-timeout, --script-memory.
    const SceneOptions& options() const { return options_; }

    // With the settings; what scripts print is printed, and so are warnings.
    SceneOptions scene_options() const;
    // What becomes of a frame that does not end at the limit of memory when it is asked to.
    enum class AtLimit { GoesOn, EndsProcess };
    // Opens the scene of a command that writes none of its files. A script that runs into its timeout ends the process,
    // now or in a later frame. Error: the file or a --set is wrong.
    Scene open(const CommonOptions& common, AtLimit frame = AtLimit::GoesOn) const;
    // Another one, with the same limits; --set is for the first one only.
    Scene open_other(const std::string& file, const CommonOptions& common) const;

private:
    std::string file_;
    std::map<std::string, std::string> settings_;
    SceneOptions options_;
};

}  // namespace rapid
