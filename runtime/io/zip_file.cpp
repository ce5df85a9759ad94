#include "runtime/io/zip_file.h"

#include <fmt/format.h>
#include <minizip/unzip.h>
#include <minizip/zip.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <limits>
#include <string_view>
#include <utility>

#include "runtime/base/memory_budget.h"
#include "runtime/files/deflate.h"

namespace rapid {
namespace {

constexpr std::size_t longest_name = 0xffff;

// Computes a position for Minizip, which seeks relative to one of these origins.
std::uint64_t seek_target(std::uint64_t offset, int origin, std::uint64_t position, std::uint64_t end)
{
    if (origin == ZLIB_FILEFUNC_SEEK_CUR) return position + offset;
    return origin == ZLIB_FILEFUNC_SEEK_END ? end + offset : offset;
}

}  // namespace

// The file as seen by Minizip. Its callbacks are C functions, so an error is stored and thrown by the caller of
// Minizip.
struct ZipWriter::Archive {
    OutputFile& file;
    std::uint64_t position = 0, end = 0;
    std::exception_ptr error = nullptr;
    zipFile zip = nullptr;

    static Archive& of(void* opaque) { return *static_cast<Archive*>(opaque); }
    static uLong write(void* opaque, void*, const void* data, uLong bytes)
    {
        Archive& archive = of(opaque);
        try {
            if (archive.error) return 0;
            archive.file.write_at(archive.position, data, bytes);
        } catch (...) {
            archive.error = std::current_exception();
            return 0;
        }
        archive.position += bytes;
        archive.end = std::max(archive.end, archive.position);
        return bytes;
    }
    static long seek(void* opaque, void*, ZPOS64_T offset, int origin)
    {
        Archive& archive = of(opaque);
        archive.position = seek_target(offset, origin, archive.position, archive.end);
        return 0;
    }
    void check(int result) const
    {
        if (error) std::rethrow_exception(error);
        if (result != ZIP_OK) throw Error(fmt::format("can't be written: Minizip's error {}", result));
    }
};

ZipWriter::ZipWriter(OutputFile& file) : archive_(new Archive{file})
{
    zlib_filefunc64_def functions = {};
    functions.zopen64_file = [](void* opaque, const void*, int) { return opaque; };
    functions.zread_file = [](void*, void*, void*, uLong) -> uLong { return 0; };
    functions.zwrite_file = Archive::write;
    functions.ztell64_file = [](void* opaque, void*) -> ZPOS64_T { return Archive::of(opaque).position; };
    functions.zseek64_file = Archive::seek;
    functions.zclose_file = [](void*, void*) { return 0; };
    functions.zerror_file = [](void*, void*) { return 0; };
    functions.opaque = archive_.get();
    archive_->zip = ::zipOpen2_64("", APPEND_STATUS_CREATE, nullptr, &functions);
    if (!archive_->zip) throw std::bad_alloc();
}

ZipWriter::~ZipWriter()
{
    if (archive_->zip) ::zipClose(archive_->zip, nullptr);
}

void ZipWriter::begin(const std::string& name, std::uint64_t bytes)
{
    zip_fileinfo info = {};
    info.dosDate = 1 << 21 | 1 << 16;  // 1980-01-01, so that the same points give the same file
    const bool large = bytes >= 0xffffffff;
    constexpr uLong utf8 = 1 << 11;
    archive_->check(::zipOpenNewFileInZip4_64(archive_->zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr,
                                              /*method: stored*/ 0, 0, 0, -MAX_WBITS, DEF_MEM_LEVEL, Z_DEFAULT_STRATEGY,
                                              nullptr, 0, 0, utf8, large));
}

void ZipWriter::write(const void* data, std::size_t bytes)
{
    archive_->check(::zipWriteInFileInZip(archive_->zip, data, static_cast<unsigned>(bytes)));
}

void ZipWriter::end() { archive_->check(::zipCloseFileInZip(archive_->zip)); }

void ZipWriter::finish()
{
    const int result = ::zipClose(std::exchange(archive_->zip, nullptr), nullptr);
    archive_->check(result);
}

struct ZipReader::Archive {
    std::span<const unsigned char> bytes;
    std::uint64_t position = 0;
    unzFile zip = nullptr;

    ~Archive()
    {
        if (zip) ::unzClose(zip);
    }
    static Archive& of(void* opaque) { return *static_cast<Archive*>(opaque); }
    static uLong read(void* opaque, void*, void* to, uLong size)
    {
        Archive& archive = of(opaque);
        const std::uint64_t left =
            archive.bytes.size() - std::min<std::uint64_t>(archive.position, archive.bytes.size());
        const std::uint64_t taken = std::min<std::uint64_t>(size, left);
        if (taken > 0) std::memcpy(to, archive.bytes.data() + archive.position, taken);
        archive.position += taken;
        return taken;
    }
    static long seek(void* opaque, void*, ZPOS64_T offset, int origin)
    {
        Archive& archive = of(opaque);
        const std::uint64_t place = seek_target(offset, origin, archive.position, archive.bytes.size());
        if (place > archive.bytes.size()) return -1;
        archive.position = place;
        return 0;
    }
};

namespace {

Error damaged_zip() { return Error("not a complete zip file: its directory is missing or damaged"); }

// Returns true if the file has the complete end record, "PK\5\6", and the comment after it. Minizip does not read the
// record's last bytes if there is a 64-bit one.
bool has_whole_end(std::span<const unsigned char> bytes)
{
    constexpr std::size_t record = 22;
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::size_t begin = text.rfind("PK\5\6");
    if (begin == std::string_view::npos || text.size() - begin < record) return false;
    const std::size_t comment = bytes[begin + record - 2] + std::size_t{256} * bytes[begin + record - 1];
    return text.size() - begin - record >= comment;
}

}  // namespace

ZipReader::ZipReader(std::span<const unsigned char> bytes) : archive_(new Archive{bytes})
{
    zlib_filefunc64_def functions = {};
    functions.zopen64_file = [](void* opaque, const void*, int) { return opaque; };
    functions.zread_file = Archive::read;
    functions.zwrite_file = [](void*, void*, const void*, uLong) -> uLong { return 0; };
    functions.ztell64_file = [](void* opaque, void*) -> ZPOS64_T { return Archive::of(opaque).position; };
    functions.zseek64_file = Archive::seek;
    functions.zclose_file = [](void*, void*) { return 0; };
    functions.zerror_file = [](void*, void*) { return 0; };
    functions.opaque = archive_.get();
    archive_->zip = ::unzOpen2_64("", &functions);
    if (!archive_->zip || !has_whole_end(bytes)) throw damaged_zip();

    // The claimed sizes of all members together must be possible for this file: members do not share bytes.
    std::uint64_t held = 0;
    std::vector<char> name(longest_name + 1);
    unz_global_info64 all = {};
    if (::unzGetGlobalInfo64(archive_->zip, &all) != UNZ_OK) throw damaged_zip();
    int result = all.number_entry == 0 ? UNZ_END_OF_LIST_OF_FILE : ::unzGoToFirstFile(archive_->zip);
    for (; result == UNZ_OK; result = ::unzGoToNextFile(archive_->zip)) {
        unz_file_info64 info = {};
        unz64_file_pos place = {};
        if (::unzGetCurrentFileInfo64(archive_->zip, &info, name.data(), name.size(), nullptr, 0, nullptr, 0) !=
                UNZ_OK ||
            ::unzGetFilePos64(archive_->zip, &place) != UNZ_OK)
            throw damaged_zip();
        const std::string text(name.data(), std::min<std::size_t>(info.size_filename, std::strlen(name.data())));
        if (info.flag & 1) throw Error(fmt::format("\"{}\" is encrypted", text));
        if (info.compression_method != 0 && info.compression_method != Z_DEFLATED)
            throw Error(fmt::format("\"{}\" is compressed by method {}; it must be stored or deflated", text,
                                    info.compression_method));
        held += std::min<std::uint64_t>(info.compressed_size, bytes.size() + 1);
        const std::uint64_t expansion = info.compression_method == 0 ? 1 : max_deflate_expansion;
        if (held > bytes.size() || info.uncompressed_size > info.compressed_size * expansion)
            throw Error(fmt::format("\"{}\" is shorter than its directory says; the file is damaged", text));
        members_.push_back({text, place.pos_in_zip_directory, place.num_of_file, info.uncompressed_size});
    }
    if (result != UNZ_END_OF_LIST_OF_FILE) throw damaged_zip();
}

ZipReader::~ZipReader() = default;

std::vector<unsigned char> ZipReader::read(const Member& member)
{
    const auto wrong = [&] { return Error(fmt::format("\"{}\" is damaged", member.name)); };
    if (const auto bytes = static_cast<double>(member.bytes); !fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("\"{}\", decompressed,", member.name), bytes,
                              "write fewer points to the file");
    const unz64_file_pos place = {member.position, member.number};
    if (::unzGoToFilePos64(archive_->zip, &place) != UNZ_OK || ::unzOpenCurrentFile(archive_->zip) != UNZ_OK)
        throw wrong();
    std::vector<unsigned char> data(member.bytes);
    constexpr std::size_t most = 1 << 30;  // a read returns an int
    for (std::size_t done = 0; done < data.size();) {
        const std::size_t needed = std::min(most, data.size() - done);
        const int read = ::unzReadCurrentFile(archive_->zip, data.data() + done, static_cast<unsigned>(needed));
        if (read <= 0) {
            ::unzCloseCurrentFile(archive_->zip);
            throw wrong();
        }
        done += static_cast<std::size_t>(read);
    }
    if (::unzCloseCurrentFile(archive_->zip) != UNZ_OK) throw wrong();
    return data;
}

}  // namespace rapid
