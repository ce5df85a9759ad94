#include "runtime/files/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>

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
    constexpr unsigned char gzip_mark[] = {0x1f, 0x8b, 8};
    if (size_ >= sizeof gzip_mark && std::memcmp(bytes_.get(), gzip_mark, sizeof gzip_mark) == 0) expand();
}

// Expands the members of a gzip file (RFC 1952), one after the other.
void InputFile::expand()
{
    struct Stream : z_stream {
        Stream() : z_stream{}
        {
            constexpr int gzip = 16;
            if (::inflateInit2(this, MAX_WBITS + gzip) != Z_OK) throw std::bad_alloc();
        }
        ~Stream() { ::inflateEnd(this); }
    } stream;
    constexpr std::size_t most = std::numeric_limits<uInt>::max() / 2;  // per call of zlib
    std::size_t used = 0, expanded = 0, room = 0;
    std::unique_ptr<unsigned char[]> to;
    for (;;) {
        if (expanded == room) {
            const std::size_t more = std::max<std::size_t>(4 * size_, 2 * room);
            if (!fits_in_memory(static_cast<double>(more)))
                throw memory_exceeded("the file, which is compressed,", static_cast<double>(more),
                                      "read a smaller file");
            auto larger = std::make_unique_for_overwrite<unsigned char[]>(more);
            if (expanded > 0) std::memcpy(larger.get(), to.get(), expanded);
            to = std::move(larger);
            room = more;
        }
        stream.next_in = bytes_.get() + used;
        stream.avail_in = static_cast<uInt>(std::min(size_ - used, most));
        stream.next_out = to.get() + expanded;
        stream.avail_out = static_cast<uInt>(std::min(room - expanded, most));
        const int result = ::inflate(&stream, Z_NO_FLUSH);
        used = static_cast<std::size_t>(stream.next_in - bytes_.get());
        expanded = static_cast<std::size_t>(stream.next_out - to.get());
        if (result == Z_MEM_ERROR) throw std::bad_alloc();
        if (result == Z_STREAM_END) {
            // Tapes and block devices pad a file with zeros.
            unsigned char* const end = bytes_.get() + size_;
            if (std::all_of(bytes_.get() + used, end, [](unsigned char byte) { return byte == 0; })) break;
            ::inflateReset(&stream);
        } else if (result != Z_OK && result != Z_BUF_ERROR) {
            throw Error("can't be read: its compressed data is damaged");
        } else if (used == size_ && expanded < room) {
            throw Error("can't be read: its compressed data ends early");
        }
    }
    bytes_ = std::move(to);
    size_ = expanded;
}

std::filesystem::path without_gz(const std::filesystem::path& path)
{
    return path.extension() == ".gz" || path.extension() == ".GZ" ? path.parent_path() / path.stem() : path;
}

std::size_t check_readable(const std::filesystem::path& path) { return open_regular(path).bytes; }

}  // namespace rapid
