#include "bindings/command/untrusted.h"

#include <fmt/format.h>

#include <cstdlib>
#include <sstream>

#include "runtime/deferred.h"

namespace rapid {
namespace {

// The parts of a list such as "/a:/b".
std::vector<std::string> parts_of_path(const char* list)
{
    std::vector<std::string> parts;
    std::stringstream text(list ? list : "");
    for (std::string part; std::getline(text, part, ':');)
        if (!part.empty()) parts.push_back(part);
    return parts;
}

// Plugins, as main() finds them, and folders of modules.
void add_own_paths(SandboxAccess& access, const CommonOptions& common)
{
    access.readable.insert(access.readable.end(), common.plugins.begin(), common.plugins.end());
    std::error_code none;
    for (const char* variable : {"RAPID_PLUGIN_PATH", "RAPID_PATH"})
        for (const std::string& path : parts_of_path(std::getenv(variable)))
            if (std::filesystem::exists(path, none)) access.readable.emplace_back(path);
}

}  // namespace

void UntrustedOptions::declare(CLI::App& app, const std::string& whose)
{
    app.add_flag("--untrusted", untrusted_,
                 "keeps the process from all files but those that it is asked to read and write, from sockets and from "
                 "other processes");
    app.add_flag(sandboxed_option, sandboxed_)->group("");  // internal: the restarted process
    app.add_option("--allow-read", allowed_,
                   fmt::format("a file or folder that an --untrusted {} may read, too", whose))
        ->type_name("PATH")
        ->allow_extra_args(false);
}

void UntrustedOptions::confine(const std::function<SandboxAccess()>& access, const CommonOptions& common,
                               Processes processes) const
{
    if (!allowed_.empty() && !untrusted_) throw Error("--allow-read is for --untrusted; a graph reads what it names");
    if (!untrusted_) return;
    if (!sandboxed_) {
        SandboxAccess all = access();
        add_own_paths(all, common);
        all.readable.insert(all.readable.end(), allowed_.begin(), allowed_.end());
        enter_sandbox(all);
    }
    load_deferred();  // the limits of memory forbid it
    complete_sandbox(processes);
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
