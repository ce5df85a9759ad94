// How a build with the address sanitizer runs: linked into each of its programs, so that none needs ASAN_OPTIONS.
#include <cstddef>
#include <cstdlib>
#include <new>

extern "C" const char* __asan_default_options()
{
    return
        // No status of the command's own, which would hide what was found.
        "exitcode=99:"
        // Memory that runs out is an error, and not the end of the process.
        "allocator_may_return_null=1:"
        // What nobody has written is not 0.
        "max_malloc_fill_size=1048576:malloc_fill_byte=165:"
        // Of the functions below some are the sanitizer's own.
        "alloc_dealloc_mismatch=0";
}

// The sanitizer's own end the process where memory runs out.
void* operator new(std::size_t bytes)
{
    if (void* const memory = std::malloc(bytes)) return memory;
    throw std::bad_alloc();
}
void* operator new(std::size_t bytes, std::align_val_t alignment)
{
    const auto unit = static_cast<std::size_t>(alignment);
    if (void* const memory = std::aligned_alloc(unit, (bytes + unit - 1) / unit * unit)) return memory;
    throw std::bad_alloc();
}
void* operator new[](std::size_t bytes) { return operator new(bytes); }
void* operator new[](std::size_t bytes, std::align_val_t alignment) { return operator new(bytes, alignment); }
