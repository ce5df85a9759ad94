#include "tests/faults/guard.h"

#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace guard {
namespace {

constexpr std::size_t page = 4096;
constexpr std::size_t room = std::size_t{1} << 38;      // of addresses; none is reused
constexpr std::size_t largest = std::size_t{16} << 20;  // larger blocks come from the C library
constexpr int max_alive = 25000;                        // each takes two of the kernel's 65,530 mappings
constexpr unsigned char untouched = 0xa5;

// Stored in the page before a block's first page.
struct Head {
    void* block;
    std::size_t bytes, pages;
};
static_assert(sizeof(Head) <= page);

std::atomic<std::uintptr_t> begin{0}, next{0};
std::atomic<int> alive{0};

bool is_requested()
{
    static const bool requested = [] {
        const char* stress = std::getenv("RAPID_STRESS");
        return stress && std::strstr(stress, "guard");
    }();
    return requested;
}

std::uintptr_t begin_of_room()
{
    static const std::uintptr_t found = [] {
        void* const addresses = ::mmap(nullptr, room, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        const auto at = addresses == MAP_FAILED ? 0 : reinterpret_cast<std::uintptr_t>(addresses);
        next = at;
        begin = at;
        return at;
    }();
    return found;
}

// The head's page precedes the page of the block's first byte.
Head& head_of(const void* block)
{
    return *reinterpret_cast<Head*>((reinterpret_cast<std::uintptr_t>(block) / page - 1) * page);
}

[[noreturn]] void end(const char* what)
{
    [[maybe_unused]] const ssize_t written = ::write(2, what, std::strlen(what));
    std::abort();
}

}  // namespace

void* take(std::size_t alignment, std::size_t bytes)
{
    if (!is_requested() || bytes > largest || alignment > page || alive >= max_alive || begin_of_room() == 0)
        return nullptr;
    const std::size_t rounded = (bytes + alignment - 1) / alignment * alignment;
    const std::size_t pages = 1 + (rounded + page - 1) / page + (rounded == 0);
    const std::uintptr_t first = next.fetch_add((pages + 1) * page);
    if (first + (pages + 1) * page > begin + room) return nullptr;
    if (::mprotect(reinterpret_cast<void*>(first), pages * page, PROT_READ | PROT_WRITE) != 0) return nullptr;
    ++alive;
    const std::uintptr_t wall = first + pages * page;
    void* const block = reinterpret_cast<void*>(wall - rounded - (rounded == 0 ? alignment : 0));
    std::memset(block, untouched, wall - reinterpret_cast<std::uintptr_t>(block));
    head_of(block) = {block, bytes, pages};
    return block;
}

bool is_guarded(const void* block)
{
    const auto at = reinterpret_cast<std::uintptr_t>(block);
    return begin != 0 && at >= begin && at < begin + room;
}

std::size_t size_of(const void* block) { return head_of(block).bytes; }

void give_back(void* block)
{
    const Head head = head_of(block);  // ends the process if the block was freed before
    if (head.block != block) end("guard: what is freed is no block\n");
    auto* const from = reinterpret_cast<unsigned char*>(&head_of(block));
    const unsigned char* const wall = from + head.pages * page;
    for (const unsigned char* at = static_cast<unsigned char*>(block) + head.bytes; at < wall; ++at)
        if (*at != untouched) end("guard: a block was written to behind its end\n");
    ::madvise(from, head.pages * page, MADV_DONTNEED);
    if (::mprotect(from, head.pages * page, PROT_NONE) != 0) end("guard: no mapping is left\n");
    --alive;
}

}  // namespace guard
