// The options of all commands that load a graph, and the loading.
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

    // Error: what is wrong with the file or with --set. may_write, on_timeout, on_read: see SessionOptions.
    std::unique_ptr<Session> load(bool may_write, std::function<void(const std::string& message)> on_timeout,
                                  std::function<void(const std::filesystem::path& file)> on_read = {}) const;
    // Another graph, with the same limits; --set is of the first one only.
    std::unique_ptr<Session> load_other(const std::string& file,
                                        std::function<void(const std::string& message)> on_timeout) const;
    // Once more, as load() has done it, without a word, and to run kernels in another order.
    std::unique_ptr<Session> load_again(const KernelOrder& order,
                                        std::function<void(const std::string& message)> on_timeout) const;

private:
    std::string file_;
    SessionOptions session_;
    std::optional<std::uint64_t> seed_;
};

}  // namespace rapid
