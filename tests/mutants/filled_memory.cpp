// Replaces glibc's malloc in the program that it is linked into and in the libraries that it loads.
#include "tests/mutants/filled_memory.h"

#include <malloc.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>

extern "C" {
void* __libc_malloc(std::size_t bytes) noexcept;
void* __libc_realloc(void* block, std::size_t bytes) noexcept;
void* __libc_memalign(std::size_t alignment, std::size_t bytes) noexcept;
}

namespace {

unsigned char pattern = 0x5a;

void* filled(void* block, std::size_t from = 0)
{
    if (!block) return nullptr;
    // Damaged files make readers allocate more than they use; filling all of it could touch a gigabyte.
    constexpr std::size_t most = std::size_t{16} << 20;
    const std::size_t end = std::min(malloc_usable_size(block), from + most);
    if (from < end) std::memset(static_cast<char*>(block) + from, pattern, end - from);
    return block;
}

}  // namespace

extern "C" {

void* malloc(std::size_t bytes) noexcept { return filled(__libc_malloc(bytes)); }

void* realloc(void* block, std::size_t bytes) noexcept
{
    const std::size_t before = block ? malloc_usable_size(block) : 0;
    return filled(__libc_realloc(block, bytes), before);
}

void* memalign(std::size_t alignment, std::size_t bytes) noexcept { return filled(__libc_memalign(alignment, bytes)); }

void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept { return memalign(alignment, bytes); }

int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) noexcept
{
    *block = memalign(alignment, bytes);
    return *block ? 0 : ENOMEM;
}

}  // extern "C"

namespace rapid::test {

void fill_new_memory(unsigned char byte) { pattern = byte; }

[[gnu::noinline]] void fill_stack(unsigned char byte)
{
    volatile unsigned char room[256 << 10];
    for (std::size_t i = 0; i < sizeof room; ++i) room[i] = byte;
}

}  // namespace rapid::test
