// The options that all commands share which load a graph, and how it is loaded.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "bindings/command/command.h"
#include "bindings/host/session.h"

namespace rapid {

class GraphOptions {
public:
    void declare(CLI::App& app);

    const std::string& file() const { return file_; }
    const std::optional<std::uint64_t>& seed() const { return seed_; }
    const SessionOptions& session() const { return session_; }

    // The sessions that are loaded from now on keep their state (SessionOptions).
    void keep_state() { session_.keeps_state = true; }

    // Error: the file or a --set is wrong. may_write, on_timeout, on_read: see SessionOptions.
    std::unique_ptr<Session> load(bool may_write, std::function<void(const std::string& message)> on_timeout,
                                  std::function<void(const std::filesystem::path& file)> on_read = {}) const;
    // The same for a command that only looks at the graph: its warnings are printed, and a script that runs into its
    // timeout ends the process.
    std::unique_ptr<Session> load_to_look_at(const CommonOptions& common) const;
    // Another graph, with the same limits; --set applies to the first one only.
    std::unique_ptr<Session> load_other(const std::string& file,
                                        std::function<void(const std::string& message)> on_timeout) const;
    // The graph of load() once more, with `print` silenced and with kernels in another order.
    std::unique_ptr<Session> load_again(const KernelOrder& order,
                                        std::function<void(const std::string& message)> on_timeout) const;

private:
    std::string file_;
    SessionOptions session_;
    std::optional<std::uint64_t> seed_;
};

}  // namespace rapid
