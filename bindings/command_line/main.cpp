// The command `rapid`: finds the command among the arguments, reads its options and runs it.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <list>
#include <map>
#include <new>
#include <optional>

#include "bindings/command_line/command.h"
#include "bindings/command_line/options.h"
#include "bindings/command_line/programs.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/setting_names.h"
#include "runtime/files/output_file.h"

namespace rapid {
namespace {

using Arguments = std::vector<std::string>;

CLI::App* find_subcommand(CLI::App& app, const std::string& name)
{
    for (CLI::App* command : app.get_subcommands({}))
        if (command->get_name() == name) return command;
    return nullptr;
}

// Returns true if an argument is an option, of any command, that takes its value from the next one.
bool takes_value(CLI::App& app, const std::string& argument)
{
    if (!argument.starts_with('-')) return false;
    for (const CLI::App* command : app.get_subcommands({}))
        if (const CLI::Option* option = command->get_option_no_throw(argument))
            if (option->get_items_expected_max() > 0) return true;
    return false;
}

// Returns the index of the command's name: the first argument that is a command and not an option's value. Options may
// also precede the name.
std::size_t find_command(CLI::App& app, const Arguments& arguments)
{
    for (std::size_t i = 0; i < arguments.size() && arguments[i] != "--"; ++i)
        if (find_subcommand(app, arguments[i]) && (i == 0 || !takes_value(app, arguments[i - 1]))) return i;
    return arguments.size();
}

Error no_command(CLI::App& app, const Arguments& arguments)
{
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    for (const std::string& argument : arguments) {
        if (argument.starts_with('-')) continue;
        if (argument.ends_with(".lua"))
            return Error(fmt::format("no command; to run the scene, type: {} run {}", name_of_command(), argument));
        const std::string near = did_you_mean(argument, names);
        return Error(fmt::format("unknown command \"{}\"{}", argument,
                                 near.empty() ? fmt::format("; it must be one of {}", fmt::join(names, ", ")) : near));
    }
    return Error(fmt::format("no command; it must be one of {}", fmt::join(names, ", ")));
}

// Returns the error for an argument without an option. Bash makes --set a={1,2,3} into --set a=1 a=2 a=3.
Error unexpected(const CLI::App& command, const std::string& argument)
{
    const std::string text = fmt::format("unexpected argument \"{}\"", argument);
    const CLI::Option* set = command.get_option_no_throw("--set");
    const std::size_t equals = argument.find('=');
    if (!set || equals == std::string::npos) return Error(text);
    const std::string name = argument.substr(0, equals + 1);
    const std::vector<std::string> given = set->results();
    if (std::any_of(given.begin(), given.end(), [&](const std::string& other) { return other.starts_with(name); }))
        return Error(fmt::format("{}; the shell has split a list, so put it in quotes: --set '{}{{...}}'", text, name));
    return Error(fmt::format("{}; to set a value, type: --set {}", text, argument));
}

// Refuses arguments that no option took.
void refuse_rest(const CLI::App& command)
{
    for (const std::string& argument : command.remaining()) {
        if (argument == "--") continue;
        if (!argument.starts_with('-')) throw unexpected(command, argument);
        std::vector<std::string> names;
        for (const CLI::Option* option : command.get_options())
            for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
        const std::string name = argument.substr(0, argument.find('='));
        throw Error(fmt::format("unknown option \"{}\"{}", name, did_you_mean(name, names)));
    }
}

// Refuses empty names of files or folders, as an unset variable of the shell leaves them.
void refuse_empty_names(const CLI::App& command)
{
    for (const CLI::Option* option : command.get_options()) {
        const std::string kind = option->get_type_name();
        if (kind != "FILE" && kind != "DIR") continue;
        for (const std::string& name : option->results())
            if (name.empty())
                throw Error(fmt::format("{} = \"\"; it must be the name of a {}", option->get_name(),
                                        kind == "DIR" ? "folder" : "file"));
    }
}

int finish(int status)
{
    // A closed pipe (`rapid nodes | head`) is not an error.
    if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return status;
    if (errno == EPIPE) return status;
    print_error(Error(fmt::format("standard output can't be written: {}", std::strerror(errno))), false);
    return status == status_done ? status_failed : status;
}

// Declares the options that every command takes.
void declare_common(CLI::App& command, CommonOptions& common)
{
    command
        .add_option_function<std::string>(
            "--threads",
            [&](const std::string& text) {
                constexpr int most = 4096;  // more is a typing error
                const std::int64_t threads = read_whole("--threads", text, 0);
                if (threads > most) throw Error(fmt::format("--threads = {}; it must be at most {}", text, most));
                common.threads = static_cast<int>(threads);
            },
            "number of threads; 0, the default, uses all of the machine")
        ->type_name("N");
    command
        .add_option_function<std::vector<std::string>>(
            "--plugin", [&](const std::vector<std::string>& files) { common.plugins = files; },
            "loads nodes from a library built against Rapid; RAPID_PLUGIN_PATH is a list of such files and folders")
        ->type_name("FILE")
        ->allow_extra_args(false);
    command.add_flag("--verbose", common.verbose, "prints the call stack of a script error");
    command.allow_extras();
}

// Reads the arguments into the options of the command that they name. Returns the exit status if the process ends
// there: for --help and --version, and for a usage error.
std::optional<int> read_arguments(CLI::App& app, Arguments arguments)
{
    std::string who = "rapid";
    try {
        const std::size_t index = find_command(app, arguments);
        CLI::App* chosen = index < arguments.size() ? app.get_subcommand(arguments[index]) : nullptr;
        if (chosen) {
            who += " " + chosen->get_name();
            std::rotate(arguments.begin(), arguments.begin() + static_cast<std::ptrdiff_t>(index),
                        arguments.begin() + static_cast<std::ptrdiff_t>(index) + 1);
        } else if (arguments.front() != "--help" && arguments.front() != "-h" && arguments.front() != "--version") {
            throw no_command(app, arguments);
        }
        std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
        app.parse(arguments);
        refuse_rest(*chosen);
        refuse_empty_names(*chosen);
        return std::nullopt;
    } catch (const CLI::Success& request) {  // --help, --version
        return app.exit(request), finish(status_done);
    } catch (const CLI::ParseError& error) {
        print_error(Error(fmt::format("{}: {}; see \"{} --help\"", who, error.what(), who)), false);
    } catch (const Error& error) {
        print_error(Error(fmt::format("{}: {}", who, error.what())), false);
    }
    return status_refused;
}

int become(const Program& program, const Arguments& arguments)
{
    try {
        become_program(program, arguments);
    } catch (const Error& error) {
        print_error(error, false);
        return status_refused;
    }
}

// Returns true if nothing given to the command is to blame: a library failed, or memory ran out.
bool is_of_system(const SceneError& error)
{
    const bool is_plain = error.file.empty() && error.node.empty() && error.message == "out of memory";
    return error.kind == SceneError::Unexpected || (error.kind == SceneError::OutOfMemory && is_plain);
}

int run_command(Command& command, const CommonOptions& common)
{
    try {
        auto* const confined = dynamic_cast<Confined*>(&command);
        if (confined) confined->confine(common);
        if (!confined || confined->takes_plugins()) {
            if (const char* path = std::getenv("RAPID_PLUGIN_PATH")) SceneInside::load_plugins(path).value();
            for (const std::string& file : common.plugins) Scene::load_plugin(file).value();
        }
        return finish(command.run(common));
    } catch (const Error& error) {
        print_error(error, common.verbose);
        return status_refused;
    } catch (const SceneException& exception) {
        print_error(exception.error(), common.verbose);
        return is_of_system(exception.error()) ? status_failed : status_refused;
    } catch (const std::bad_alloc&) {
        print_error(Error("out of memory"), false);
    } catch (const std::exception& error) {  // from a library: its text is all that is known
        print_error(Error(error.what()), false);
    }
    return status_failed;
}

// Sets the names under which the library's messages refer to settings.
void name_options()
{
    name_settings({{Setting::Memory, "--memory"},
                   {Setting::ScriptMemory, "--script-memory"},
                   {Setting::ScriptSeconds, "--script-timeout"},
                   {Setting::Value, "--set"},
                   {Setting::Seed, "--seed"},
                   {Setting::EstimateErrors, "--quiet"},
                   {Setting::Output, "-o"},
                   {Setting::Frames, "-f"},
                   {Setting::PictureSize, "--size"},
                   {Setting::Statistics, "--stats"},
                   {Setting::Profile, "--profile"},
                   {Setting::Events, "--events"},
                   {Setting::Cache, "--cache"},
                   {Setting::CacheAgain, "--again"},
                   {Setting::Part, "--part"},
                   {Setting::Parts, "--parts"},
                   {Setting::Sample, "--sample"}});
}

int run(const Arguments& arguments)
{
    name_options();
    CLI::App app("Rapid: a particle system. Scenes are Lua files.", "rapid");
    app.set_version_flag("--version", "rapid " RAPID_VERSION);
    app.footer(
        "`rapid COMMAND --help` lists the options of a command. Exit status: 0 done; 1 an error while a frame ran, a "
        "failed\ntest, a difference; 2 an error before the first frame (usage, a mistake in the graph, a missing "
        "file).");
    app.require_subcommand(0, 1);  // after a command, another command's name is an argument: `rapid nodes merge`
    CommonOptions common;
    const std::vector<std::unique_ptr<Command>> commands = make_commands();
    const bool is_rapid = commands.size() > 1;  // otherwise a program with one command of its own
    std::map<std::string, Command*> all;        // null: a program, which knows its options
    for (const auto& command : commands) all[command->name()] = command.get();
    if (is_rapid)
        for (const Program& program : programs()) all[program.name] = nullptr;
    std::list<Options> declared;
    for (const auto& [name, command] : all) {
        CLI::App* options = app.add_subcommand(name, command ? command->doc() : program(name).doc);
        if (command) command->declare(declared.emplace_back(*options));
        declare_common(*options, common);
    }

    if (arguments.empty()) {
        print(app.help());
        return finish(status_done);
    }
    const std::size_t index = find_command(app, arguments);
    if (index < arguments.size() && !all.at(arguments[index])) return become(program(arguments[index]), arguments);
    if (const std::optional<int> status = read_arguments(app, arguments)) return *status;
    for (const auto& command : commands)
        if (app.got_subcommand(command->name())) return run_command(*command, common);
    return status_refused;
}

}  // namespace
}  // namespace rapid

namespace {

// Ends the process after an error within a library that cannot pass an exception on: CLI11 and libstdc++ allocate in
// functions that may not throw. This function allocates nothing.
void end_without_exception()
{
    const char* text = "an exception could not be passed on, usually because memory ran out\n";
    try {
        if (std::current_exception()) throw;
    } catch (const std::bad_alloc&) {
        text = "out of memory\n";
    } catch (...) {
        __gnu_cxx::__verbose_terminate_handler();  // a bug in Rapid: aborts
    }
    rapid::remove_unfinished_files();
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text, std::strlen(text));
    ::_exit(rapid::status_failed);
}

}  // namespace

int main(int argc, char** argv)
{
    std::set_terminate(end_without_exception);
    std::signal(SIGXFSZ, SIG_IGN);  // a file that exceeds a limit is an ordinary error
    int status = rapid::status_failed;
    try {
        status = rapid::run({argv + 1, argv + argc});
    } catch (const std::bad_alloc&) {  // reporting it like other errors would allocate
        std::fputs("out of memory\n", stderr);
    }
    // Libraries (OpenVDB's log4cplus) allocate at exit, and end the process with an error if memory has run out.
    std::fflush(nullptr);
    std::_Exit(status);
}
