#include "bindings/command_line/programs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "bindings/command_line/program_list.h"
#include "runtime/base/error.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

fs::path this_file() { return fs::read_symlink("/proc/self/exe"); }

}  // namespace

std::span<const Program> programs() { return program_list; }

const Program& program(std::string_view name)
{
    return *std::find_if(std::begin(program_list), std::end(program_list),
                         [&](const Program& one) { return one.name == name; });
}

fs::path command_file()
{
    const fs::path file = this_file();
    const bool is_program = std::any_of(std::begin(program_list), std::end(program_list),
                                        [&](const Program& one) { return file.filename() == one.name; });
    return is_program ? (file.parent_path() / command_folder / "rapid").lexically_normal() : file;
}

void become_program(const Program& program, std::vector<std::string> arguments)
{
    const fs::path file = (this_file().parent_path() / programs_folder / program.name).lexically_normal();
    std::string name = "rapid";
    std::vector<char*> words = {name.data()};
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    execv(file.c_str(), words.data());
    const int error = errno;
    throw Error(fmt::format("{} can't be started ({}); it belongs next to {}, and `ninja rapid_{}` builds it",
                            file.string(), std::strerror(error), this_file().string(), program.name));
}

}  // namespace rapid
