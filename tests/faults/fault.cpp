// A library to preload (LD_PRELOAD) that makes one system call fail:
//
//   RAPID_FAULT=CALL:N:ERROR   the Nth call (from 1) of CALL ends with ERROR, and all later ones if ERROR ends in "+"
//
// CALL: open, write, fsync, close, link, rename (of output files and their folders), read (of any regular file), alloc
// (an allocation after main began, through malloc, calloc, realloc or an aligned variant), or state (an allocation
// while LuaJIT creates a state or opens its ffi library). ERROR: the number of an error, or "short": half of the bytes,
// or one, are written or read.
//
//   RAPID_FAULT_LIST=FILE   a list of faults, one per line. For the kth, a copy of the process, taken after its
//   libraries
//                           are loaded, runs in a separate folder k; its output is in k/said; "k STATUS" is printed
//   RAPID_STRESS=collector   Lua collects garbage all the time
//   RAPID_STRESS=guard       an access past the end of a memory block, or to a freed one, ends the process
//                            (both: collector,guard)
//   RAPID_FAULT_COUNT=FILE   receives the number of calls of CALL when the process ends by itself
#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/faults/guard.h"

namespace {

constexpr int short_count = -1;
constexpr std::size_t malloc_alignment = 16;

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

// Libraries that allocate without checking the result cannot report a fault: libgcc, which registers the code that
// LuaJIT compiles (gcc 12), and Blosc. The address ranges of these libraries:
struct Careless {
    const char* name;
    std::atomic<std::uintptr_t> begin, end;
};
Careless careless[] = {{"libgcc_s", 0, 0}, {"libblosc", 0, 0}};

int find_careless(dl_phdr_info* library, std::size_t, void*)
{
    for (Careless& one : careless) {
        if (!std::strstr(library->dlpi_name, one.name)) continue;
        std::uintptr_t end = library->dlpi_addr;
        for (int k = 0; k < library->dlpi_phnum; ++k)
            end = std::max(end, library->dlpi_addr + library->dlpi_phdr[k].p_vaddr + library->dlpi_phdr[k].p_memsz);
        one.begin = library->dlpi_addr;
        one.end = end;
    }
    return 0;
}

bool is_careless(void* caller)
{
    const auto at = reinterpret_cast<std::uintptr_t>(caller);
    return std::any_of(std::begin(careless), std::end(careless),
                       [at](const Careless& one) { return at >= one.begin && at < one.end; });
}

void arm_with(const char* text)
{
    char error[16] = "";
    if (!text || std::sscanf(text, "%15[^:]:%ld:%15s", fault.call, &fault.nth, error) != 3) return;
    fault.lasting = std::strchr(error, '+') != nullptr;
    fault.error = std::strncmp(error, "short", 5) == 0 ? short_count : std::atoi(error);
    ::dl_iterate_phdr(find_careless, nullptr);
    armed = true;
}

// Set up at the first call after the libraries are loaded.
struct Arm {
    Arm() { arm_with(std::getenv("RAPID_FAULT")); }
    ~Arm() { end(); }

    void end()
    {
        armed = false;
        const char* path = std::getenv("RAPID_FAULT_COUNT");
        std::FILE* file = path ? std::fopen(path, "w") : nullptr;
        if (!file) return;
        std::fprintf(file, "%ld\n", calls.load());
        std::fclose(file);
    }
} arm;

// Returns the error of this call, or 0.
int error_of(const char* call)
{
    if (!armed || std::strcmp(call, fault.call) != 0) return 0;
    const long now = ++calls;
    return now == fault.nth || (fault.lasting && now > fault.nth) ? fault.error : 0;
}

// How many libraries this thread is opening, nested. Their constructors cannot report that memory has run out.
thread_local int loading __attribute__((tls_model("initial-exec"))) = 0;

// True while this thread is in lua_newstate() or luaopen_ffi(), which a failed allocation leaves by a jump or an error.
thread_local bool makes_state __attribute__((tls_model("initial-exec"))) = false;

// Returns true if this allocation by `caller` must fail.
bool fails(void* caller)
{
    if (!armed || !began || loading > 0 || is_careless(caller)) return false;
    if (!makes_state || error_of("state") == 0) return error_of("alloc") > 0;
    makes_state = false;
    return true;
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

// Returns in each copy; the original process exits.
void copy_for_each(const char* list)
{
    constexpr unsigned max_seconds = 300;
    std::ifstream file(list);
    std::vector<std::string> faults;
    for (std::string line; std::getline(file, line);) faults.push_back(line);
    file.close();  // a copy that shared it would move the file position
    for (std::size_t k = 1; k <= faults.size(); ++k) {
        const std::string folder = std::to_string(k);
        const pid_t copy = ::fork();
        if (copy < 0) std::exit(1);
        if (copy == 0) {
            if (::mkdir(folder.c_str(), 0777) != 0 || ::chdir(folder.c_str()) != 0) std::_Exit(100);
            const int said = ::creat("said", 0666);
            for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) ::dup2(said, stream);
            ::close(said);
            ::alarm(max_seconds);
            return arm_with(faults[k - 1].c_str());
        }
        int status = 0;
        ::waitpid(copy, &status, 0);
        std::printf("%zu %d\n", k, WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
        std::fflush(stdout);
    }
    std::exit(0);
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

// dlsym() may allocate, so the C library's internal names for these are used.
void* __libc_malloc(std::size_t bytes) noexcept;
void* __libc_calloc(std::size_t count, std::size_t bytes) noexcept;
void* __libc_realloc(void* block, std::size_t bytes) noexcept;
void* __libc_memalign(std::size_t alignment, std::size_t bytes) noexcept;
void __libc_free(void* block) noexcept;

static void* aligned(std::size_t alignment, std::size_t bytes, void* caller) noexcept
{
    if (fails(caller)) return errno = ENOMEM, nullptr;
    void* const guarded = guard::take(alignment, bytes);
    return guarded ? guarded : __libc_memalign(alignment, bytes);
}

void* malloc(std::size_t bytes) noexcept
{
    if (fails(__builtin_return_address(0))) return errno = ENOMEM, nullptr;
    void* const guarded = guard::take(malloc_alignment, bytes);
    return guarded ? guarded : __libc_malloc(bytes);
}

void* calloc(std::size_t count, std::size_t bytes) noexcept
{
    if (fails(__builtin_return_address(0))) return errno = ENOMEM, nullptr;
    std::size_t all = 0;
    if (__builtin_mul_overflow(count, bytes, &all)) return errno = ENOMEM, nullptr;
    void* const guarded = guard::take(malloc_alignment, all);
    return guarded ? std::memset(guarded, 0, all) : __libc_calloc(count, bytes);
}

void* realloc(void* block, std::size_t bytes) noexcept
{
    if (fails(__builtin_return_address(0))) return errno = ENOMEM, nullptr;
    // A block that was not guarded stays unguarded, because its size is unknown.
    const bool was_guarded = guard::is_guarded(block);
    if (block && !was_guarded) return __libc_realloc(block, bytes);
    void* moved = guard::take(malloc_alignment, bytes);
    if (!moved) moved = __libc_malloc(bytes);
    if (!moved || !block) return moved;
    std::memcpy(moved, block, std::min(bytes, guard::size_of(block)));
    guard::give_back(block);
    return moved;
}

void free(void* block) noexcept { guard::is_guarded(block) ? guard::give_back(block) : __libc_free(block); }

std::size_t malloc_usable_size(void* block) noexcept
{
    static const auto original = next<std::size_t (*)(void*)>("malloc_usable_size");
    return guard::is_guarded(block) ? guard::size_of(block) : original(block);
}

void* memalign(std::size_t alignment, std::size_t bytes) noexcept
{
    return aligned(alignment, bytes, __builtin_return_address(0));
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept
{
    return aligned(alignment, bytes, __builtin_return_address(0));
}

int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) noexcept
{
    void* const found = aligned(alignment, bytes, __builtin_return_address(0));
    if (!found) return ENOMEM;
    *block = found;
    return 0;
}

void* dlopen(const char* file, int mode) noexcept
{
    static const auto original = next<void* (*)(const char*, int)>("dlopen");
    ++loading;
    void* const library = original(file, mode);
    --loading;
    ::dl_iterate_phdr(find_careless, nullptr);
    return library;
}

struct lua_State;

int luaopen_ffi(lua_State* state)
{
    static const auto original = next<decltype(&luaopen_ffi)>("luaopen_ffi");
    makes_state = true;
    const int results = original(state);
    makes_state = false;
    return results;
}

lua_State* lua_newstate(void* (*allocate)(void*, void*, std::size_t, std::size_t), void* data)
{
    static const auto original = next<decltype(&lua_newstate)>("lua_newstate");
    makes_state = true;
    lua_State* const state = original(allocate, data);
    makes_state = false;
    const char* const stress = std::getenv("RAPID_STRESS");
    if (state && stress && std::strstr(stress, "collector")) {
        constexpr int set_pause = 6, set_step = 7;  // as in lua.h
        const auto collect = next<int (*)(lua_State*, int, int)>("lua_gc");
        collect(state, set_pause, 0);
        collect(state, set_step, 1000);
    }
    return state;
}

// Called when the process ends without its destructors.
void _Exit(int status)
{
    arm.end();
    ::_exit(status);
}

// Starts main(). Allocations are counted from here on: an earlier failure could not be reported.
int __libc_start_main(Main program, int count, char** arguments, void (*init)(), void (*fini)(), void (*loader)(),
                      void* stack)
{
    using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
    program_main = program;
    const auto begin = [](int c, char** a, char** environment) {
        if (const char* list = std::getenv("RAPID_FAULT_LIST")) copy_for_each(list);
        began = true;
        return program_main(c, a, environment);
    };
    return next<Start>("__libc_start_main")(begin, count, arguments, init, fini, loader, stack);
}

}  // extern "C"
