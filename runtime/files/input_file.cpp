#include "runtime/files/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "runtime/base/memory_budget.h"
#include "runtime/files/file_error.h"
#include "runtime/files/output_file.h"

namespace rapid {

void write_whole(const std::filesystem::path& path, std::string_view bytes)
{
    try {
        OutputFile file(path);
        file.append(bytes.data(), bytes.size());
        file.finish();
    } catch (Error& error) {
        throw error.at({path.string(), 0});
    }
}

namespace {

struct OpenFile {
    Descriptor descriptor;
    std::size_t bytes;
};

OpenFile open_regular(const std::filesystem::path& path)
{
    if (path.native().find('\0') != std::string::npos) throw Error("can't be read: its name contains a zero byte");
    // O_NONBLOCK keeps the opening of a pipe from waiting for its writer.
    Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!descriptor) throw file_error("can't be read", errno);
    struct stat status = {};
    if (::fstat(descriptor.number(), &status) != 0) throw file_error("can't be read", errno);
    if (S_ISDIR(status.st_mode)) throw file_error("can't be read", EISDIR);
    if (!S_ISREG(status.st_mode)) throw Error("can't be read: it is not a regular file");
    return {std::move(descriptor), static_cast<std::size_t>(status.st_size)};
}

void read_block(int descriptor, unsigned char* to, std::size_t begin, std::size_t end)
{
    while (begin < end) {
        const ssize_t count = ::pread(descriptor, to + begin, end - begin, static_cast<off_t>(begin));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw file_error("can't be read", errno);
        if (count == 0) throw Error("can't be read: it was shortened while it was read");
        begin += static_cast<std::size_t>(count);
    }
}

}  // namespace

std::string_view InputFile::text() const
{
    constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
    std::string_view all(reinterpret_cast<const char*>(bytes_.get()), size_);
    if (all.starts_with(byte_order_mark)) all.remove_prefix(byte_order_mark.size());
    return all;
}

InputFile::InputFile(const std::filesystem::path& path)
{
    const OpenFile file = open_regular(path);
    if (const auto bytes = static_cast<double>(file.bytes); !fits_in_memory(bytes))  // a sparse file may have any size
        throw memory_exceeded("the whole file", bytes, "read a smaller file");
    bytes_ = std::make_unique_for_overwrite<unsigned char[]>(file.bytes);
    size_ = file.bytes;
    constexpr std::size_t block = std::size_t{4} << 20;  // large enough to amortise a task, small enough to distribute
    tbb::parallel_for(std::size_t{0}, (size_ + block - 1) / block, [&](std::size_t i) {
        read_block(file.descriptor.number(), bytes_.get(), i * block, std::min(size_, (i + 1) * block));
    });
}

std::size_t check_readable(const std::filesystem::path& path) { return open_regular(path).bytes; }

}  // namespace rapid
