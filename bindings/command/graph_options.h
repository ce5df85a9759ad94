// Sessions of the commands that load a graph by themselves.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "bindings/command/scene_arguments.h"
#include "bindings/host/session.h"

namespace rapid {

class GraphOptions : public SceneArguments {
public:
    SessionOptions session() const;

    // The sessions that are loaded from now on keep their state (SessionOptions).
    void keep_state() { keeps_state_ = true; }

    // Error: the file or a --set is wrong. may_write, on_timeout, on_read: see SessionOptions.
    std::unique_ptr<Session> load(bool may_write, std::function<void(const std::string& message)> on_timeout,
                                  std::function<void(const std::filesystem::path& file)> on_read = {}) const;
    // Another graph, with the same limits; --set applies to the first one only.
    std::unique_ptr<Session> load_other(const std::string& file,
                                        std::function<void(const std::string& message)> on_timeout) const;
    // The graph of load() once more, with `print` silenced and with kernels in another order.
    std::unique_ptr<Session> load_again(const KernelOrder& order,
                                        std::function<void(const std::string& message)> on_timeout) const;

private:
    bool keeps_state_ = false;
};

}  // namespace rapid
