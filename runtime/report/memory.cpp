#include "runtime/report/memory.h"

#include <fstream>
#include <string>

namespace rapid {

// Not getrusage: its ru_maxrss survives exec, so that a command started by a large program would report that program's.
std::uint64_t peak_memory()
{
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
        if (word != "VmHWM:") continue;
        std::uint64_t kibibytes = 0;
        status >> kibibytes;
        return kibibytes * 1024;
    }
    return 0;
}

}  // namespace rapid
