// A command of `rapid`: one file in this folder, which registers itself; nothing else names it.
//
// Exit statuses are those of the contract: 0 done, 1 found while a frame ran (or a test failed, or a difference was
// found), 2 found before. An Error that rises out of run() is one found before the first frame.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/error.h"

namespace rapid {

enum ExitStatus : int { status_done = 0, status_failed = 1, status_refused = 2 };

// What every command takes.
struct CommonOptions {
    int threads = 0;  // 0: all that the machine has
    bool verbose = false;
    std::vector<std::string> plugins;  // files
};

class Command {
public:
    virtual ~Command() = default;
    virtual std::string name() const = 0;
    virtual std::string doc() const = 0;
    // Declares the options that run() will read.
    virtual void declare(CLI::App& app) = 0;
    virtual int run(const CommonOptions& common) = 0;
};

// In order of name.
std::vector<std::unique_ptr<Command>> make_commands();

struct CommandRegistration {
    explicit CommandRegistration(std::unique_ptr<Command> (*make)());
};
#define RAPID_COMMAND(Type)                                           \
    static const ::rapid::CommandRegistration registration_of_##Type( \
        []() -> std::unique_ptr<::rapid::Command> { return std::make_unique<Type>(); })

// Text to standard output. Unlike fmt::print it does not throw where the reader has gone; main() reports what could not
// be written.
void print(std::string_view text);
// To standard error: the error as it is, and its trace behind it with --verbose. Above a progress bar, if there is one.
void print_error(const Error& error, bool verbose);
void print_warning(const std::string& warning);

// Values of options. Error: what was given, and what would be right.
std::int64_t read_whole(const std::string& option, const std::string& text, std::int64_t least);
std::uint64_t read_seed(const std::string& text);
double read_positive(const std::string& option, const std::string& text);
std::size_t read_bytes(const std::string& option, const std::string& text);  // 1048576, 512K, 512M, 1G

}  // namespace rapid
