// The memory that a run may take. What needs much is estimated before it is begun, and refused with numbers where it
// does not fit: the kernel would end the process without a word.
#pragma once

#include <cstdint>
#include <string>

#include "runtime/error.h"

namespace rapid {

// Bytes that the process may have in all. At first: what it has, and what the machine and its control group have free.
std::uint64_t memory_budget();
void set_memory_budget(std::uint64_t bytes);
// Whether somebody has set it, for the process or for this thread.
bool is_memory_limited();

// Another budget for what this thread begins, for as long as it lives: where one process runs several scenes. 0: that
// of the process.
class MemoryBudget {
public:
    explicit MemoryBudget(std::uint64_t bytes);
    ~MemoryBudget();
    MemoryBudget(const MemoryBudget&) = delete;
    MemoryBudget& operator=(const MemoryBudget&) = delete;

private:
    std::uint64_t before_;
};

// What is less is not asked for.
constexpr std::uint64_t negligible_memory = std::uint64_t{64} << 20;  // bytes

// Whether the process may have so many bytes more.
bool fits_in_memory(double bytes);

// Bytes that the process may have more.
std::uint64_t free_memory();

// "WHAT would take about 119.2 GiB, and 21.3 GiB are free; REMEDY, or set --memory"
Error beyond_memory(const std::string& what, double bytes, const std::string& remedy);

// "119.2 GiB", "12 MiB"
std::string memory_text(double bytes);

}  // namespace rapid
