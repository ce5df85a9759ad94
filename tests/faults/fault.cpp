// A library to preload (LD_PRELOAD) that makes one call of the system fail:
//
//   RAPID_FAULT=CALL:N:ERROR   the N-th call (from 1) of CALL ends with ERROR, and all later ones if ERROR ends in "+"
//
// CALL: open, write, fsync, close, link, rename (of files that are written, and of their folders), read (of any regular
// file) or alloc (of memory, after main began). ERROR: an error's number, or "short": half the bytes, or one, are
// written or read.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

constexpr int short_count = -1;

struct Fault {
    char call[16] = "";
    long nth = 0;
    int error = 0;
    bool lasting = false;
};

Fault fault;
std::atomic<long> calls{0};
std::atomic<bool> armed{false}, began{false};

using Main = int (*)(int, char**, char**);
Main program_main;

// At the first call after the libraries are there.
struct Arm {
    Arm()
    {
        const char* text = std::getenv("RAPID_FAULT");
        char error[16] = "";
        if (!text || std::sscanf(text, "%15[^:]:%ld:%15s", fault.call, &fault.nth, error) != 3) return;
        fault.lasting = std::strchr(error, '+') != nullptr;
        fault.error = std::strncmp(error, "short", 5) == 0 ? short_count : std::atoi(error);
        armed = true;
    }
} arm;

// The error of this call; 0: none.
int error_of(const char* call)
{
    if (!armed || std::strcmp(call, fault.call) != 0) return 0;
    const long now = ++calls;
    return now == fault.nth || (fault.lasting && now > fault.nth) ? fault.error : 0;
}

// libgcc registers the code that LuaJIT compiles, in memory that it does not check (gcc 12): it can't report a fault.
bool is_unwinder(void* caller)
{
    Dl_info found;
    return ::dladdr(caller, &found) && std::strstr(found.dli_fname, "libgcc_s");
}

bool is_regular(int descriptor)
{
    struct stat status = {};
    return ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

bool is_written(int descriptor)
{
    const int flags = ::fcntl(descriptor, F_GETFL);
    return flags >= 0 && (flags & O_ACCMODE) != O_RDONLY && is_regular(descriptor);
}

template <class F>
F next(const char* name)
{
    return reinterpret_cast<F>(::dlsym(RTLD_NEXT, name));
}

int open_file(const char* path, int flags, unsigned mode)
{
    static const auto original = next<int (*)(const char*, int, ...)>("open64");
    if ((flags & O_ACCMODE) != O_RDONLY)
        if (const int error = error_of("open"); error > 0) return errno = error, -1;
    return original(path, flags, mode);
}

ssize_t write_file(int descriptor, const void* data, std::size_t bytes, off_t offset)
{
    static const auto original = next<ssize_t (*)(int, const void*, std::size_t, off_t)>("pwrite64");
    const int error = is_written(descriptor) ? error_of("write") : 0;
    if (error > 0) return errno = error, -1;
    return original(descriptor, data, error == short_count ? (bytes + 1) / 2 : bytes, offset);
}

ssize_t read_file(int descriptor, void* data, std::size_t bytes, off_t offset)
{
    static const auto original = next<ssize_t (*)(int, void*, std::size_t, off_t)>("pread64");
    const int error = is_regular(descriptor) ? error_of("read") : 0;
    if (error > 0) return errno = error, -1;
    return original(descriptor, data, error == short_count ? (bytes + 1) / 2 : bytes, offset);
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...)
{
    va_list arguments;
    va_start(arguments, flags);
    const unsigned mode = va_arg(arguments, unsigned);
    va_end(arguments);
    return open_file(path, flags, mode);
}

int open64(const char* path, int flags, ...)
{
    va_list arguments;
    va_start(arguments, flags);
    const unsigned mode = va_arg(arguments, unsigned);
    va_end(arguments);
    return open_file(path, flags, mode);
}

ssize_t pwrite(int descriptor, const void* data, std::size_t bytes, off_t offset)
{
    return write_file(descriptor, data, bytes, offset);
}

ssize_t pwrite64(int descriptor, const void* data, std::size_t bytes, off_t offset)
{
    return write_file(descriptor, data, bytes, offset);
}

ssize_t pread(int descriptor, void* data, std::size_t bytes, off_t offset)
{
    return read_file(descriptor, data, bytes, offset);
}

ssize_t pread64(int descriptor, void* data, std::size_t bytes, off_t offset)
{
    return read_file(descriptor, data, bytes, offset);
}

int close(int descriptor)
{
    static const auto original = next<int (*)(int)>("close");
    const int error = is_written(descriptor) ? error_of("close") : 0;
    const int result = original(descriptor);
    return error > 0 ? (errno = error, -1) : result;
}

int fsync(int descriptor)
{
    static const auto original = next<int (*)(int)>("fsync");
    if (const int error = error_of("fsync"); error > 0) return errno = error, -1;
    return original(descriptor);
}

int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) noexcept
{
    static const auto original = next<int (*)(int, const char*, int, const char*, int)>("linkat");
    if (const int error = error_of("link"); error > 0) return errno = error, -1;
    return original(from_folder, from, to_folder, to, flags);
}

int rename(const char* from, const char* to) noexcept
{
    static const auto original = next<int (*)(const char*, const char*)>("rename");
    if (const int error = error_of("rename"); error > 0) return errno = error, -1;
    return original(from, to);
}

void* __libc_malloc(std::size_t bytes) noexcept;

// dlsym() may allocate, so the C library's own name for it is taken.
void* malloc(std::size_t bytes) noexcept
{
    if (began)
        if (const int error = error_of("alloc"); error > 0 && !is_unwinder(__builtin_return_address(0)))
            return errno = error, nullptr;
    return __libc_malloc(bytes);
}

// Starts main(), from which on allocations are counted: before it nobody could report one that fails.
int __libc_start_main(Main program, int count, char** arguments, void (*init)(), void (*fini)(), void (*loader)(),
                      void* stack)
{
    using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
    program_main = program;
    const auto begin = [](int c, char** a, char** environment) {
        began = true;
        return program_main(c, a, environment);
    };
    return next<Start>("__libc_start_main")(begin, count, arguments, init, fini, loader, stack);
}

}  // extern "C"
