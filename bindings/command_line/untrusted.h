// --untrusted and --allow-read, of the commands that run a graph or read files.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bindings/command_line/command.h"
#include "bindings/command_line/process_sandbox.h"

namespace rapid {

// A command that can run in the sandbox.
class Confined {
public:
    virtual ~Confined() = default;
    // Sandboxes the process where an option asks for it; called before plugins are loaded, and before run().
    virtual void confine(const CommonOptions& common) = 0;
    // Whether this process loads plugins; not where others do the work.
    virtual bool takes_plugins() const { return true; }
};

class UntrustedOptions {
public:
    // whose: what --allow-read is for, "graph" or "file".
    void declare(Options& options, const std::string& whose);
    bool asked() const { return untrusted_; }

    // Sandboxes the process, if that is asked for. access: what the command itself reads and writes, besides
    // --allow-read and plugins. Before plugins are loaded: their first code runs in the sandbox, too.
    void confine(const std::function<SandboxAccess()>& access, const CommonOptions& common,
                 Processes processes = Processes::None, Connections connections = Connections::None) const;

    // These options again, for a process of its own.
    std::vector<std::string> words() const;

private:
    bool untrusted_ = false, sandboxed_ = false;
    std::vector<std::string> allowed_;
};

// The folder that a file lies in.
std::filesystem::path folder_of(const std::filesystem::path& file);

}  // namespace rapid
