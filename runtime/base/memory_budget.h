// The memory that a run may use. Large allocations are estimated in advance and refused with numbers if they do not
// fit, because the kernel would kill the process without a message.
#pragma once

#include <cstdint>
#include <string>

#include "runtime/base/error.h"

namespace rapid {

// Returns the bytes that the process may use in total. The default is its current memory plus the free memory of the
// machine and its control group.
std::uint64_t memory_budget();
void set_memory_budget(std::uint64_t bytes);
// Returns true if a budget has been set, for the process or for this thread.
bool is_memory_limited();

// Sets another budget for the work that this thread starts during its lifetime, for processes that run several scenes.
// 0 selects the budget of the process.
class MemoryBudget {
public:
    explicit MemoryBudget(std::uint64_t bytes);
    ~MemoryBudget();
    MemoryBudget(const MemoryBudget&) = delete;
    MemoryBudget& operator=(const MemoryBudget&) = delete;

private:
    std::uint64_t before_;
};

// Smaller amounts are not checked.
constexpr std::uint64_t negligible_memory = std::uint64_t{64} << 20;  // bytes

// Returns true if the process may use this many additional bytes.
bool fits_in_memory(double bytes);

// Returns the additional bytes that the process may use.
std::uint64_t free_memory();

// Returns the error "WHAT would need about 119.2 GiB, but only 21.3 GiB of 64.0 GiB are free; REMEDY, or set
// --memory".
Error memory_exceeded(const std::string& what, double bytes, const std::string& remedy);

// Returns a string such as "119.2 GiB" or "12 MiB".
std::string memory_text(double bytes);

}  // namespace rapid
