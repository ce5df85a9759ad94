#include "bindings/run/piece_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "runtime/files/content_hash.h"
#include "runtime/memory_budget.h"

namespace rapid {
namespace {

struct Head {
    std::uint64_t bytes;  // of the piece
    std::uint64_t hash;   // of the piece
};

void write_at(int file, std::uint64_t offset, const void* data, std::size_t bytes)
{
    const char* from = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t written = ::pwrite(file, from, bytes, static_cast<off_t>(offset));
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) throw file_error("can't be written", written < 0 ? errno : ENOSPC);
        from += written;
        offset += static_cast<std::uint64_t>(written);
        bytes -= static_cast<std::size_t>(written);
    }
}

// False: the file ends before.
bool read_at(int file, std::uint64_t offset, void* data, std::size_t bytes)
{
    char* to = static_cast<char*>(data);
    while (bytes > 0) {
        const ssize_t read = ::pread(file, to, bytes, static_cast<off_t>(offset));
        if (read < 0 && errno == EINTR) continue;
        if (read < 0) throw file_error("can't be read", errno);
        if (read == 0) return false;
        to += read;
        offset += static_cast<std::uint64_t>(read);
        bytes -= static_cast<std::size_t>(read);
    }
    return true;
}

}  // namespace

PieceLog::PieceLog(const std::filesystem::path& path)
    : file_(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666))
{
    if (!file_) throw file_error("can't be opened", errno);
}

void PieceLog::add(std::string_view piece)
{
    const Head head{piece.size(), content_hash(piece)};
    write_at(file_.number(), bytes_ + sizeof head, piece.data(), piece.size());
    write_at(file_.number(), bytes_, &head, sizeof head);
    bytes_ += sizeof head + piece.size();
}

void PieceLog::read(std::uint64_t bytes, const std::function<void(std::string_view piece)>& f) const
{
    struct stat file;
    if (::fstat(file_.number(), &file) != 0) throw file_error("can't be read", errno);
    if (bytes > static_cast<std::uint64_t>(file.st_size)) throw Error("it is damaged");
    std::string piece;
    for (std::uint64_t at = 0; at < bytes; at += sizeof(Head) + piece.size()) {
        Head head;
        if (bytes - at < sizeof head || !read_at(file_.number(), at, &head, sizeof head) ||
            head.bytes > bytes - at - sizeof head)
            throw Error("it is damaged");
        if (!fits_in_memory(static_cast<double>(head.bytes)))
            throw beyond_memory("a piece of it", static_cast<double>(head.bytes), "give another folder");
        piece.resize(head.bytes);
        if (!read_at(file_.number(), at + sizeof head, piece.data(), piece.size()) || content_hash(piece) != head.hash)
            throw Error("it is damaged");
        f(piece);
    }
}

}  // namespace rapid
