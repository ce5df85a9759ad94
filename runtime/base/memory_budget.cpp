#include "runtime/base/memory_budget.h"
#include "runtime/base/setting_names.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <utility>

namespace rapid {
namespace {

constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();

std::atomic<std::uint64_t> budget{0};  // 0: not yet determined
std::atomic<bool> is_budget_set{false};
thread_local std::uint64_t budget_of_thread = 0;  // 0: use that of the process

// Returns the number at the start of a file, or nothing if there is none, as in "max".
std::optional<std::uint64_t> number_in(const std::filesystem::path& file)
{
    std::uint64_t number = 0;
    std::ifstream in(file);
    return in >> number ? std::optional(number) : std::nullopt;
}

// Returns the resident memory of the process.
std::uint64_t own_memory()
{
    std::uint64_t pages = 0;
    std::ifstream in("/proc/self/statm");
    in >> pages >> pages;  // the first number is the address space
    return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::uint64_t free_in_machine()
{
    std::ifstream info("/proc/meminfo");
    for (std::string word; info >> word;) {
        if (word != "MemAvailable:") continue;
        std::uint64_t kibibytes = 0;
        info >> kibibytes;
        return kibibytes * 1024;
    }
    return unlimited;
}

// Returns the free memory in the control group of the process and its ancestors, for cgroup v1 and v2.
std::uint64_t free_in_groups()
{
    std::uint64_t least = unlimited;
    const auto take = [&](const std::filesystem::path& folder, const char* limit, const char* used) {
        const auto most = number_in(folder / limit), now = number_in(folder / used);
        if (most && now) least = std::min(least, *most > *now ? *most - *now : 0);
    };
    std::ifstream groups("/proc/self/cgroup");  // ID:CONTROLLERS:PATH
    for (std::string line; std::getline(groups, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        for (std::filesystem::path path = line.substr(second + 1);; path = path.parent_path()) {
            const std::filesystem::path below = path.relative_path();
            if (controllers.empty())
                take(std::filesystem::path("/sys/fs/cgroup") / below, "memory.max", "memory.current");
            else if (controllers.find("memory") != std::string::npos)
                take(std::filesystem::path("/sys/fs/cgroup/memory") / below, "memory.limit_in_bytes",
                     "memory.usage_in_bytes");
            if (below.empty()) break;
        }
    }
    return least;
}

}  // namespace

std::uint64_t memory_budget()
{
    if (budget_of_thread != 0) return budget_of_thread;
    std::uint64_t bytes = budget;
    if (bytes != 0) return bytes;
    const std::uint64_t free = std::min(free_in_machine(), free_in_groups());
    bytes = free == unlimited ? unlimited : own_memory() + free;
    budget = bytes;
    return bytes;
}

void set_memory_budget(std::uint64_t bytes)
{
    budget = bytes;
    is_budget_set = true;
}

bool is_memory_limited() { return budget_of_thread != 0 || is_budget_set; }

MemoryBudget::MemoryBudget(std::uint64_t bytes) : before_(std::exchange(budget_of_thread, bytes)) {}
MemoryBudget::~MemoryBudget() { budget_of_thread = before_; }

bool fits_in_memory(double bytes)
{
    if (bytes < static_cast<double>(negligible_memory)) return true;
    return static_cast<double>(own_memory()) + bytes <= static_cast<double>(memory_budget());
}

std::uint64_t free_memory()
{
    const std::uint64_t most = memory_budget(), used = own_memory();
    return most - std::min(most, used);
}

Error memory_exceeded(const std::string& what, double bytes, const std::string& remedy)
{
    return Error(fmt::format("{} would need about {}, but only {} of {} are free; {}, or set {}", what,
                             memory_text(bytes), memory_text(static_cast<double>(free_memory())),
                             memory_text(static_cast<double>(memory_budget())), remedy, name_of(Setting::Memory)),
                 ErrorKind::OutOfMemory);
}

std::string memory_text(double bytes)
{
    return bytes < 0x1p30 ? fmt::format("{:.0f} MiB", bytes / 0x1p20) : fmt::format("{:.1f} GiB", bytes / 0x1p30);
}

}  // namespace rapid
