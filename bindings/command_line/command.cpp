#include "bindings/command_line/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "include/rapid/scene.h"
#include "runtime/base/printable.h"
#include "runtime/files/output_file.h"

namespace rapid {
namespace {

// Static in a function, so that it exists before the first registration, in any file.
std::vector<std::unique_ptr<Command> (*)()>& command_makers()
{
    static std::vector<std::unique_ptr<Command> (*)()> all;
    return all;
}

// Parses all of `text` as a number.
template <class T>
bool parse(std::string_view text, T& value)
{
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

void print_error(std::string_view error, std::string_view trace)
{
    std::fflush(stdout);
    std::string text = printable(error) + '\n';
    if (!trace.empty()) text += printable(trace) + '\n';
    std::fwrite(text.data(), 1, text.size(), stderr);
}

}  // namespace

std::string name_of_command()
{
    const std::string called = program_invocation_name;  // of glibc: argv[0]
    return called.find('/') == std::string::npos ? "rapid" : called;
}

CommandRegistration::CommandRegistration(std::unique_ptr<Command> (*make)()) { command_makers().push_back(make); }

std::vector<std::unique_ptr<Command>> make_commands()
{
    std::vector<std::unique_ptr<Command>> commands;
    for (const auto make : command_makers()) commands.push_back(make());
    std::sort(commands.begin(), commands.end(), [](const auto& a, const auto& b) { return a->name() < b->name(); });
    return commands;
}

void print(std::string_view text)
{
    const std::string shown = printable(text);
    std::fwrite(shown.data(), 1, shown.size(), stdout);
}

void print_error(const Error& error, bool verbose) { print_error(error.what(), verbose ? error.trace() : ""); }

void print_error(const SceneError& error, bool verbose)
{
    print_error(error.text(), verbose ? error.script_stack : "");
}

void print_warning(const std::string& warning)
{
    std::fflush(stdout);
    constexpr std::size_t most = 4000;  // bytes, as for an error
    const std::string text = fmt::format("warning: {}\n", printable(shortened(warning, most)));
    std::fwrite(text.data(), 1, text.size(), stderr);
}

std::function<void(const std::string& message)> end_at_limit(const CommonOptions& common)
{
    return [verbose = common.verbose](const std::string& message) {
        print_error(Error(message), verbose);
        remove_unfinished_files();
        _exit(status_failed);
    };
}

std::int64_t read_whole(const std::string& option, const std::string& text, std::int64_t least)
{
    std::int64_t value = 0;
    if (!parse(text, value) || value < least)
        throw Error(fmt::format("{} = \"{}\"; it must be a whole number, at least {}", option, text, least));
    return value;
}

std::uint64_t read_seed(const std::string& text)
{
    std::uint64_t value = 0;
    if (!parse(text, value))
        throw Error(fmt::format("--seed = \"{}\"; it must be a whole number from 0 to 2^64 - 1", text));
    return value;
}

double read_positive(const std::string& option, const std::string& text)
{
    double value = 0;
    if (!parse(text, value) || !(value > 0) || !std::isfinite(value))
        throw Error(fmt::format("{} = \"{}\"; it must be a number above 0", option, text));
    return value;
}

std::size_t read_bytes(const std::string& option, const std::string& text)
{
    constexpr std::string_view units = "KMG";
    const std::size_t unit = text.empty() ? std::string_view::npos : units.find(text.back());
    const int shift = unit == std::string_view::npos ? 0 : 10 * (static_cast<int>(unit) + 1);
    std::uint64_t value = 0;
    const bool number = parse(std::string_view(text).substr(0, text.size() - (shift > 0)), value);
    if (!number || value == 0 || value > (UINT64_MAX >> shift))
        throw Error(fmt::format("{} = \"{}\"; it must be a number of bytes above 0, such as 1073741824, 512M or 1G",
                                option, text));
    return value << shift;
}

}  // namespace rapid
