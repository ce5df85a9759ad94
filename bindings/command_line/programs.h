// Commands that are programs of their own: `rapid NAME` becomes libexec/rapid/NAME. Not everybody who runs a scene
// needs them, so ./rapid builds one when it is first asked for.
//
// A program is a folder of bindings with a program.txt, the line that `rapid --help` has of it, and a Command of the
// folder's name.
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

// In order of name.
std::span<const Program> programs();
const Program& program(std::string_view name);  // which there is

// The file of `rapid`, for it and for its programs.
std::filesystem::path command_file();

// Becomes the program, with the arguments of this process. Error: it can't be started.
[[noreturn]] void become_program(const Program& program, std::vector<std::string> arguments);

}  // namespace rapid
