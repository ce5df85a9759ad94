// Options shared by all commands that open a scene, and the opening itself.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "bindings/command_line/command.h"
#include "include/rapid/scene.h"
#include "runtime/base/cancellation.h"
#include "runtime/base/memory_watch.h"

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

    // Returns options with the settings; output of scripts and warnings are printed.
    SceneOptions scene_options() const;
    // Action for a frame that does not end at the memory limit when requested.
    enum class AtLimit { Continues, EndsProcess };
    // Opens the scene of a command that writes none of its files. A script that exceeds its timeout ends the process,
    // now or in a later frame. Throws Error if the file or a --set is wrong.
    Scene open(const CommonOptions& common, AtLimit frame = AtLimit::Continues) const;
    // Opens another scene with the same limits; --set applies only to the first one.
    Scene open_other(const std::string& file, const CommonOptions& common) const;

private:
    std::string file_;
    std::map<std::string, std::string> settings_;
    SceneOptions options_;
};

// While it lives, work on this thread ends with an Error of the node if the process exceeds --memory. file: the graph.
// end: called from another thread if that comes too late; it must not return.
class MemoryLimit {
public:
    MemoryLimit(const std::string& file, const std::function<void(const std::string& message)>& end)
        : watch_(
              MemoryWatch::now(), [this](const Error& error) { cancellation_.request(error); },
              [this, file, end](const Error& error) {
                  end(cancellation_.placed(error).at({file, 0}).what());
              })
    {
    }

private:
    Cancellation cancellation_;
    Cancellation::Scope scope_{&cancellation_};
    MemoryWatch watch_;
};

}  // namespace rapid
