// A target of libFuzzer for Rapid's own readers: the first byte chooses one. tests/fuzz/run builds and runs it.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "runtime/error.h"
#include "runtime/io/format.h"
#include "runtime/shapes/mesh/mesh_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    if (size == 0) return 0;
    // A file without a name: the readers take a path.
    static const int file = ::memfd_create("input", 0);
    static const std::string path = "/proc/self/fd/" + std::to_string(file);
    if (::ftruncate(file, 0) != 0 || ::pwrite(file, data + 1, size - 1, 0) != static_cast<ssize_t>(size - 1))
        std::abort();
    try {
        const char* formats[] = {"a.csv", "a.bgeo", "a.ply", "", "a.npz", "a.prt", "a.usda", "a.vtp", "a.obj"};
        if (const char* format = formats[data[0] % 9]; *format)
            rapid::format_of(format).read(path);
        else
            rapid::read_ply_mesh(path);
    } catch (const rapid::Error&) {
    }
    return 0;
}
