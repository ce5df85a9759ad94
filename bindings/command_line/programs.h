// Commands that are separate programs: `rapid NAME` becomes libexec/rapid/NAME. Not every user needs them, so ./rapid
// builds one when it is first used.
//
// A program is a folder of bindings with a program.txt, its line in `rapid --help`, and a Command with the folder's
// name.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

struct Program {
    const char* name;
    const char* doc;
};

// Returns the programs, ordered by name.
std::span<const Program> programs();
const Program& program(std::string_view name);  // precondition: it exists

// Returns the file of `rapid`, also in its programs.
std::filesystem::path command_file();

// Replaces this process with the program and these arguments. Throws Error if it cannot be started.
[[noreturn]] void become_program(const Program& program, std::vector<std::string> arguments);

}  // namespace rapid
