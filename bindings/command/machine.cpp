#include "bindings/command/machine.h"

#include <fmt/format.h>
#include <luajit.h>
#include <sys/utsname.h>
#include <tbb/version.h>

#include <fstream>
#include <thread>

namespace rapid {
namespace {

std::string processor()
{
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name"))
            if (const std::size_t at = line.find(": "); at != std::string::npos) return line.substr(at + 2);
    return "unknown";
}

}  // namespace

std::vector<std::pair<std::string, std::string>> describe_machine(int threads)
{
    utsname system{};
    uname(&system);
    return {{"processor", processor()},
            {"processors", fmt::format("{}", std::thread::hardware_concurrency())},
            {"threads", fmt::format("{}", threads)},
            {"system", fmt::format("{} {} {}", system.sysname, system.release, system.machine)},
            {"rapid", RAPID_VERSION},
            {"compiler", __VERSION__},
            {"luajit", LUAJIT_VERSION},
            {"tbb", TBB_runtime_version()}};
}

}  // namespace rapid
