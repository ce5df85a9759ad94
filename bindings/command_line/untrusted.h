// Options --untrusted and --allow-read, of the commands that run a graph or read files.
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
    // Sandboxes the process if an option requests it; called before plugins are loaded, and before run().
    virtual void confine(const CommonOptions& common) = 0;
    // Returns false if other processes do the work, and this one loads no plugins.
    virtual bool takes_plugins() const { return true; }
};

class UntrustedOptions {
public:
    // whose: the subject of --allow-read, "graph" or "file".
    void declare(Options& options, const std::string& whose);
    bool requested() const { return untrusted_; }

    // Sandboxes the process if requested. access: the files that the command itself reads and writes, besides
    // --allow-read and plugins. Call it before plugins are loaded: their initialisation runs in the sandbox, too.
    void confine(const std::function<SandboxAccess()>& access, const CommonOptions& common,
                 Processes processes = Processes::None, Connections connections = Connections::None) const;

    // Returns these options as arguments for another process.
    std::vector<std::string> words() const;

private:
    bool untrusted_ = false, sandboxed_ = false;
    std::vector<std::string> allowed_;
};

// Returns the folder of a file.
std::filesystem::path folder_of(const std::filesystem::path& file);

}  // namespace rapid
