// Options of the address sanitizer, linked into each program of such a build so that none needs ASAN_OPTIONS.
#include <cstddef>
#include <cstdlib>
#include <new>

extern "C" const char* __asan_default_options()
{
    return
        // A status that the command itself never uses; one of its own would hide a report.
        "exitcode=99:"
        // An allocation that fails is an error; it does not end the process.
        "allocator_may_return_null=1:"
        // Uninitialised memory is not 0.
        "max_malloc_fill_size=1048576:malloc_fill_byte=165:"
        // Some of the functions below are the sanitizer's own.
        "alloc_dealloc_mismatch=0";
}

// The sanitizer's own versions end the process if memory runs out.
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
