// .npz: NumPy's archive (numpy.lib.format), a zip file of arrays with a member NAME.npy for each attribute.
//
//   0x93 "NUMPY" 1 0 | uint16: bytes of the header | {'descr': '<f4', 'fortran_order': False, 'shape': (n, 3), }
//
// padded by spaces to 64 bytes, then the numbers. P and every vec3 are <f4 (n, 3), a quaternion <f4 (n, 4) x y z w, a
// float <f4 (n,), integers <i4 and <i8, and a string <Un (n characters of the longest one, 4 bytes each). A group is
// |b1 group_NAME. Members are stored uncompressed, as by numpy.savez.
//
// Reads archives of numpy.savez and numpy.savez_compressed, in any byte and dimension order. Skips arrays of objects
// (which are Python programs), with more than two dimensions, with more than 16 numbers per point, or without n rows. A
// |b1 (n,) is a group.
#include <fmt/format.h>
#include <minizip/unzip.h>
#include <minizip/zip.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/base/memory_budget.h"
#include "runtime/base/parallel.h"
#include "runtime/files/deflate.h"
#include "runtime/files/input_file.h"
#include "runtime/files/output_file.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/records.h"
#include "runtime/io/text_table.h"

namespace rapid {

// Zip files through Minizip: written to an OutputFile as they grow, read from memory.
//
// Errors do not contain the file's name; the caller adds it.
class ZipWriter {
public:
    explicit ZipWriter(OutputFile& file);
    ZipWriter(const ZipWriter&) = delete;
    ZipWriter& operator=(const ZipWriter&) = delete;
    ~ZipWriter();

    // Begins an uncompressed member of this size. Its time is the earliest that a zip file can store.
    void begin(const std::string& name, std::uint64_t bytes);
    void write(const void* data, std::size_t bytes);
    void end();
    // Writes the directory.
    void finish();

private:
    struct Archive;
    std::unique_ptr<Archive> archive_;
};

class ZipReader {
public:
    struct Member {
        std::string name;
        std::uint64_t position;  // in the directory
        std::uint64_t number;
        std::size_t bytes;
    };

    // `bytes` must outlive it. Throws Error if this is not a zip file, or if members are encrypted or claim more than
    // the file can contain.
    explicit ZipReader(std::span<const unsigned char> bytes);
    ZipReader(const ZipReader&) = delete;
    ZipReader& operator=(const ZipReader&) = delete;
    ~ZipReader();

    const std::vector<Member>& members() const { return members_; }
    // Throws Error if the checksum shows damage.
    std::vector<unsigned char> read(const Member& member);

private:
    struct Archive;
    std::unique_ptr<Archive> archive_;
    std::vector<Member> members_;
};

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

namespace {

constexpr std::string_view npy_magic = "\x93NUMPY", suffix = ".npy";

std::string_view numpy_type(AttributeType type)
{
    if (type == AttributeType::Int32) return "<i4";
    return type == AttributeType::Int64 ? "<i8" : "<f4";
}

// Returns the characters of a string.
std::u32string characters_of(Token token)
{
    std::u32string result;
    for (const char c : token.text()) {
        const auto byte = static_cast<unsigned char>(c);
        if ((byte & 0xc0) == 0x80)
            result.back() = result.back() << 6 | (byte & 0x3f);
        else
            result += byte < 0x80 ? byte : byte < 0xe0 ? byte & 0x1f : byte < 0xf0 ? byte & 0x0f : byte & 0x07;
    }
    return result;
}

void append_utf8(std::string& to, std::uint32_t c)
{
    const auto put = [&](std::uint32_t byte) { to += static_cast<char>(byte); };
    if (c < 0x80) return put(c);
    const int more = c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
    put((0xff00 >> (more + 1) & 0xff) | c >> 6 * more);
    for (int k = more - 1; k >= 0; --k) put(0x80 | (c >> 6 * k & 0x3f));
}

std::string npy_header(std::string_view type, std::size_t n, std::size_t count)
{
    std::string dictionary = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({},{}), }}", type, n,
                                         count > 1 ? fmt::format(" {}", count) : "");
    const std::size_t before = npy_magic.size() + 2 + 2;
    dictionary.resize((before + dictionary.size() + 1 + 63) / 64 * 64 - before - 1, ' ');
    dictionary += '\n';
    std::string header = std::string(npy_magic) + '\1' + '\0';
    header += static_cast<char>(dictionary.size() & 0xff);
    header += static_cast<char>(dictionary.size() >> 8);
    return header + dictionary;
}

void write_array(ZipWriter& zip, const std::string& name, const std::string& header, const RecordWriter& array,
                 std::size_t n)
{
    zip.begin(name + std::string(suffix), header.size() + n * array.record_bytes());
    zip.write(header.data(), header.size());
    std::vector<unsigned char> numbers(std::min(n, chunk_size) * array.record_bytes());
    for (std::size_t begin = 0; begin < n; begin += chunk_size) {
        const std::size_t end = std::min(n, begin + chunk_size);
        array.interleave(begin, end, numbers.data());
        zip.write(numbers.data(), (end - begin) * array.record_bytes());
    }
    zip.end();
}

void write_strings(ZipWriter& zip, const std::string& name, const Column<Token>& column)
{
    const TextTable table = text_table(column);
    std::vector<std::u32string> strings;
    std::size_t longest = 1;
    for (const Token text : table.strings)
        longest = std::max(longest, strings.emplace_back(characters_of(text)).size());
    const std::string header = npy_header(fmt::format("<U{}", longest), column.size(), 1);
    const std::size_t bytes = longest * sizeof(char32_t);
    zip.begin(name + std::string(suffix), header.size() + column.size() * bytes);
    zip.write(header.data(), header.size());
    // Each string is padded to the length of the longest. This happens only in the file.
    constexpr std::size_t most = std::size_t{1} << 20;
    std::string piece;
    for (std::size_t i = 0; i < column.size(); ++i) {
        const std::u32string& text = strings[static_cast<std::size_t>(table.indices[i])];
        piece.append(reinterpret_cast<const char*>(text.data()), text.size() * sizeof(char32_t));
        for (std::size_t left = bytes - text.size() * sizeof(char32_t), some; left > 0; left -= some) {
            some = std::min(left, most);
            piece.append(some, '\0');
            if (piece.size() < most) continue;
            zip.write(piece.data(), piece.size());
            piece.clear();
        }
    }
    zip.write(piece.data(), piece.size());
    zip.end();
}

void write_npz(OutputFile& file, const PointSet& points, const FrameInfo&)
{
    std::vector<std::string> attributes = further_attributes(points), names;
    attributes.insert(attributes.begin(), {"P", "v", "id"});
    names = attributes;
    for (const std::string& group : points.group_names()) names.push_back(std::string(group_prefix) + group);
    check_column_names(names, std::string_view("/\\\0", 3));

    ZipWriter zip(file);
    for (const std::string& name : attributes) {
        const AnyColumn& column = *points.find(name);
        if (const auto* strings = std::get_if<Column<Token>>(&column)) {
            write_strings(zip, name, *strings);
            continue;
        }
        RecordWriter array(ByteOrder::Little, RecordWriter::Wide);
        array.add(name, column);
        const AttributeType type = type_of(column);
        write_array(zip, name, npy_header(numpy_type(type), points.size(), component_count(type)), array,
                    points.size());
    }
    for (const auto& [name, members] : points.groups()) {
        RecordWriter array(ByteOrder::Little);
        array.add_bytes(members);
        write_array(zip, std::string(group_prefix) + name, npy_header("|b1", points.size(), 1), array, points.size());
    }
    zip.finish();
}

// The header of an array: a Python dictionary with a string, a bool and a tuple of integers.
class NpyHeader {
public:
    explicit NpyHeader(std::string_view text) : text_(text)
    {
        expect('{');
        while (!accept('}')) {
            const std::string_view key = quoted();
            expect(':');
            if (key == "descr" && (peek() == '\'' || peek() == '"'))
                descr = quoted();
            else if (key == "fortran_order")
                fortran = word() == "True";
            else if (key == "shape")
                read_shape();
            else
                return;  // a list, which denotes a structure of several types
            accept(',');
        }
        complete = true;
    }

    std::string_view descr;
    bool fortran = false, complete = false;
    std::vector<std::uint64_t> shape;

private:
    char peek()
    {
        const std::size_t at = text_.find_first_not_of(" \t\r\n");
        if (at == std::string_view::npos) throw Error("the header of the array is cut off");
        text_.remove_prefix(at);
        return text_.front();
    }
    bool accept(char c)
    {
        if (peek() != c) return false;
        text_.remove_prefix(1);
        return true;
    }
    void expect(char c)
    {
        if (!accept(c)) throw Error(fmt::format("the header of the array lacks a '{}'", c));
    }
    std::string_view quoted()
    {
        const char quote = peek();
        const std::size_t end = text_.find(quote, 1);
        if ((quote != '\'' && quote != '"') || end == std::string_view::npos)
            throw Error("the header of the array lacks a string");
        const std::string_view result = text_.substr(1, end - 1);
        text_.remove_prefix(end + 1);
        return result;
    }
    std::string_view word()
    {
        peek();
        const std::string_view result = text_.substr(0, text_.find_first_of(" ,}"));
        text_.remove_prefix(result.size());
        return result;
    }
    void read_shape()
    {
        expect('(');
        while (!accept(')')) {
            peek();
            const auto parsed = std::from_chars(text_.data(), text_.data() + text_.size(), shape.emplace_back());
            if (parsed.ec != std::errc()) throw Error("the shape of the array is not a tuple of whole numbers");
            text_.remove_prefix(static_cast<std::size_t>(parsed.ptr - text_.data()));
            accept(',');
        }
    }

    std::string_view text_;
};

// An element type. For strings `scalar` is the character type, UInt32 (U) or UInt8 (S), and `characters` their count.
struct NumberType {
    ScalarType scalar;
    ByteOrder order;
    bool truth;
    std::size_t characters = 0;
};

constexpr std::size_t max_characters = 1 << 20;

std::optional<NumberType> text_type(std::string_view descr)
{
    const bool wide = descr.substr(1, 1) == "U";
    std::size_t characters = 0;
    const auto parsed = std::from_chars(descr.data() + 2, descr.data() + descr.size(), characters);
    if (parsed.ec != std::errc() || parsed.ptr != descr.data() + descr.size()) return {};
    if (characters < 1 || characters > max_characters) return {};
    return NumberType{wide ? ScalarType::UInt32 : ScalarType::UInt8,
                      descr[0] == '>' ? ByteOrder::Big : ByteOrder::Little, false, characters};
}

// Returns nothing for types other than numbers.
std::optional<NumberType> number_type(std::string_view descr)
{
    static const std::map<std::string_view, ScalarType> types = {
        {"f2", ScalarType::Half},   {"f4", ScalarType::Float},  {"f8", ScalarType::Double}, {"i1", ScalarType::Int8},
        {"i2", ScalarType::Int16},  {"i4", ScalarType::Int32},  {"i8", ScalarType::Int64},  {"u1", ScalarType::UInt8},
        {"u2", ScalarType::UInt16}, {"u4", ScalarType::UInt32}, {"u8", ScalarType::UInt64}, {"b1", ScalarType::UInt8}};
    if (descr.empty() || std::string_view("<>|=").find(descr[0]) == std::string_view::npos) return {};
    if (descr.size() > 2 && (descr[1] == 'U' || descr[1] == 'S')) return text_type(descr);
    const auto found = types.find(descr.substr(1));
    if (found == types.end()) return {};
    return NumberType{found->second, descr[0] == '>' ? ByteOrder::Big : ByteOrder::Little, descr.substr(1) == "b1"};
}

struct Array {
    NumberType type;
    std::size_t rows, numbers;  // per row
    bool fortran;
    std::span<const unsigned char> bytes;
};

// Returns nothing for arrays that can't be an attribute.
std::optional<Array> array_in(std::span<const unsigned char> bytes)
{
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (!text.starts_with(npy_magic) || bytes.size() < 12) throw Error("not a NumPy array");
    const std::size_t length_bytes = bytes[6] == 1 ? 2 : 4, begin = 8 + length_bytes;
    std::size_t length = 0;
    for (std::size_t b = length_bytes; b-- > 0;) length = length << 8 | bytes[8 + b];
    if (length > bytes.size() - begin) throw Error("the header of the array is cut off");
    const NpyHeader header(text.substr(begin, length));
    const std::optional<NumberType> type = number_type(header.descr);
    if (!header.complete || !type || header.shape.empty() || header.shape.size() > 2) return {};
    const std::uint64_t rows = header.shape[0], numbers = header.shape.size() == 2 ? header.shape[1] : 1;
    if (numbers < 1 || numbers > (type->characters > 0 ? 1 : max_numbers)) return {};
    const std::span<const unsigned char> data = bytes.subspan(begin + length);
    const std::size_t row = numbers * scalar_bytes(type->scalar) * std::max<std::size_t>(1, type->characters);
    if (rows > data.size() / row)
        throw Error(fmt::format("the array ends early: its header announces {} rows, but it contains {}", rows,
                                data.size() / row));
    return Array{*type, rows, numbers, header.fortran, data};
}

// Reads strings. Shorter ones end with zeros.
Column<Token> strings_in(const Array& array)
{
    Column<Token> column;
    const std::span<Token> to = column.append_for_writing(array.rows);
    const std::size_t bytes = scalar_bytes(array.type.scalar);
    const unsigned char* at = array.bytes.data();
    std::string text;
    StringTokens token_of_row;
    for (Token& token : to) {
        text.clear();
        for (std::size_t k = 0; k < array.type.characters; ++k, at += bytes) {
            if (array.type.scalar == ScalarType::UInt8)
                text += static_cast<char>(*at);
            else if (const auto c = load_scalar<std::uint32_t>(at, array.type.order); c <= 0x10ffff)
                append_utf8(text, c);
            else
                throw Error(fmt::format("the string of a row has the invalid character {}", c));
        }
        text.resize(text.find_last_not_of('\0') + 1);
        token = token_of_row(text);
    }
    return column;
}

void read_array(PointSet& points, const std::string& name, const Array& array)
{
    if (array.type.characters > 0) return points.set(name, array.rows > 0 ? strings_in(array) : Column<Token>());
    RecordAttribute attribute;
    attribute.type = array.type.scalar;
    attribute.group = array.type.truth && array.numbers == 1;
    attribute.name = attribute.group && name.starts_with(group_prefix) ? name.substr(group_prefix.size()) : name;
    const std::size_t number = scalar_bytes(array.type.scalar);
    // In Fortran order all first components come first.
    for (std::size_t c = 0; c < array.numbers; ++c)
        attribute.offsets.push_back(array.fortran ? c * array.rows * number : c * number);
    const std::size_t stride = array.fortran ? number : array.numbers * number;
    read_attribute(points, {array.bytes, array.rows, stride, array.type.order}, attribute);
}

bool is_positions(const Array& array) { return array.numbers == 3 && array.type.characters == 0 && !array.type.truth; }

PointSet read_npz(const std::filesystem::path& path)
{
    const InputFile file(path);
    ZipReader zip(file.bytes());
    const auto with_array = [&](const ZipReader::Member& member, const auto& use) {
        const std::vector<unsigned char> bytes = zip.read(member);
        try {
            if (const std::optional<Array> array = array_in(bytes))
                use(*array);
            else
                SkippedContents::add(fmt::format(
                    "the array \"{}\", which does not have a number or string for each point", member.name));
        } catch (const Error& error) {
            throw Error(fmt::format("\"{}\": {}", member.name, error.what()), error.kind());
        }
    };

    PointSet points;
    std::vector<std::string> names;
    bool placed = false;
    for (const ZipReader::Member& member : zip.members()) {
        if (member.name.ends_with(suffix)) names.push_back(member.name.substr(0, member.name.size() - suffix.size()));
        if (member.name != "P.npy") continue;
        with_array(member, [&](const Array& array) {
            placed = is_positions(array);
            if (placed && points.empty()) points.append(array.rows);
        });
    }
    check_column_names(names, "");
    if (!placed) throw Error("there is no array P of numbers with the shape (n, 3)");
    bool has_id = false;
    for (const ZipReader::Member& member : zip.members()) {
        if (!member.name.ends_with(suffix)) continue;
        const std::string name = member.name.substr(0, member.name.size() - suffix.size());
        with_array(member, [&](const Array& array) {
            if (array.rows != points.size())
                return SkippedContents::add(fmt::format("the array \"{}\" of {} rows, but there are {} points",
                                                        member.name, array.rows, points.size()));
            read_array(points, name, array);
            has_id |= name == "id" && array.numbers == 1 && !array.type.truth && array.type.characters == 0;
        });
    }
    if (!has_id) number_points(points);
    return points;
}

// Reads an array of shape (n, 3), as numpy.save writes it.
PointSet read_npy(const std::filesystem::path& path)
{
    const InputFile file(path);
    const std::optional<Array> array = array_in(file.bytes());
    if (!array || !is_positions(*array)) throw Error("the array is not one of numbers with the shape (n, 3)");
    PointSet points;
    points.append(array->rows);
    if (!points.empty()) read_array(points, "P", *array);
    number_points(points);
    return points;
}

RAPID_POINT_READER(".npy", read_npy);
RAPID_FORMAT(Format{".npz", "NumPy's arrays, one for each attribute; all types", write_npz, read_npz});

}  // namespace

}  // namespace rapid
