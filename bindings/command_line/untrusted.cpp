#include "bindings/command_line/untrusted.h"

#include <fmt/format.h>

#include "bindings/scene/installation.h"
#include "runtime/base/path_list.h"

namespace rapid {
namespace {

// Adds plugins, as main() finds them, and folders of modules.
void add_own_paths(SandboxAccess& access, const CommonOptions& common)
{
    access.readable.insert(access.readable.end(), common.plugins.begin(), common.plugins.end());
    std::error_code none;
    for (const char* variable : {"RAPID_PLUGIN_PATH", "RAPID_PATH"})
        for (const std::string& path : path_list_of(variable))
            if (std::filesystem::exists(path, none)) access.readable.emplace_back(path);
}

}  // namespace

void UntrustedOptions::declare(Options& options, const std::string& whose)
{
    options.add_flag("--untrusted", untrusted_,
                     "runs in a sandbox: no files except those named, no sockets, no other processes");
    options.add_flag(sandboxed_option, sandboxed_).internal();  // set in the restarted process
    options
        .add_option("--allow-read", allowed_,
                    fmt::format("a further file or folder that an --untrusted {} may read", whose))
        .type_name("PATH")
        .one_value();
}

void UntrustedOptions::confine(const std::function<SandboxAccess()>& access, const CommonOptions& common,
                               Processes processes, Connections connections) const
{
    if (!allowed_.empty() && !untrusted_)
        throw Error("--allow-read needs --untrusted; otherwise a graph may read any file");
    if (!untrusted_) return;
    if (!sandboxed_) {
        SandboxAccess all = access();
        add_own_paths(all, common);
        all.readable.insert(all.readable.end(), allowed_.begin(), allowed_.end());
        enter_sandbox(all);
    }
    Installation::load_all().value();  // the memory limits forbid it later
    complete_sandbox(processes, connections);
}

std::vector<std::string> UntrustedOptions::words() const
{
    std::vector<std::string> words;
    if (untrusted_) words.push_back("--untrusted");
    for (const std::string& path : allowed_) words.push_back("--allow-read=" + path);
    return words;
}

std::filesystem::path folder_of(const std::filesystem::path& file)
{
    return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

}  // namespace rapid
