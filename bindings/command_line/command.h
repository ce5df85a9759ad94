// A command of `rapid`: one file in this folder, which registers itself; no other file names it.
//
// Exit statuses: 0 done; 1 an error while a frame ran, a failed test, a difference; 2 an error before the first frame,
// which is any Error thrown by run().
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bindings/command_line/options.h"
#include "runtime/base/error.h"

namespace rapid {

struct SceneError;

enum ExitStatus : int { status_done = 0, status_failed = 1, status_refused = 2 };

// Options of every command.
struct CommonOptions {
    int threads = 0;  // 0: as many as the machine has
    bool verbose = false;
    std::vector<std::string> plugins;  // files
};

class Command {
public:
    virtual ~Command() = default;
    virtual std::string name() const = 0;
    virtual std::string doc() const = 0;
    // Declares the options that run() will read.
    virtual void declare(Options& options) = 0;
    virtual int run(const CommonOptions& common) = 0;
};

// Returns the word by which the user called this program: "rapid", or a path such as "./rapid".
std::string name_of_command();

// Returns the commands, ordered by name.
std::vector<std::unique_ptr<Command>> make_commands();

struct CommandRegistration {
    explicit CommandRegistration(std::unique_ptr<Command> (*make)());
};
#define RAPID_COMMAND(Type)                                           \
    static const ::rapid::CommandRegistration registration_of_##Type( \
        []() -> std::unique_ptr<::rapid::Command> { return std::make_unique<Type>(); })

// Writes to standard output. Unlike fmt::print it does not throw if the reader has closed the pipe; main() reports a
// failure to write.
void print(std::string_view text);
// Writes the error to standard error, and its trace with --verbose. Clears a progress bar, if there is one.
void print_error(const Error& error, bool verbose);
void print_error(const SceneError& error, bool verbose);
void print_warning(const std::string& warning);

// Returns a handler for limits reached in the middle of an operation, from any thread: it prints the message and ends
// the process.
std::function<void(const std::string& message)> end_at_limit(const CommonOptions& common);

// Parse values of options. Errors quote the value and name valid ones.
std::int64_t read_whole(const std::string& option, const std::string& text, std::int64_t least);
std::uint64_t read_seed(const std::string& text);
double read_positive(const std::string& option, const std::string& text);
std::size_t read_bytes(const std::string& option, const std::string& text);  // 1048576, 512K, 512M, 1G

}  // namespace rapid
