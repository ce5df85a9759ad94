// .vtp: VTK's PolyData in XML ("VTK File Formats"), as ParaView and VTK read it. The arrays are appended to the XML in
// binary, each after a byte count:
//
//   <VTKFile type="PolyData" ...> ... <DataArray type="Float32" Name="v" ... offset="0"/> ...
//   <AppendedData encoding="raw">_ | for each array: uint64 bytes, its numbers | </AppendedData></VTKFile>
//
// P is the Points, a string attribute is an Array of type String (its bytes: each string and a zero byte), any other
// attribute is an array of the PointData, and a group is UInt8 group_NAME. One cell with all points makes them visible.
// The field TimeValue is the time of the frame, s.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <map>
#include <new>
#include <numeric>
#include <optional>
#include <pugixml.hpp>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/files/base64.h"
#include "runtime/files/deflate.h"
#include "runtime/files/input_file.h"
#include "runtime/files/scalars.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/point_file.h"
#include "runtime/io/records.h"
#include "runtime/io/text_table.h"
#include "runtime/points/token.h"

namespace rapid {
namespace {

// The arrays of VTK's XML files: inside the XML as text ("ascii") or Base64 ("binary"), or appended to it, raw or as
// Base64; optionally compressed by zlib; in either byte order.
//
// Nothing in a file is trusted. Errors do not contain the file's name; the caller adds it.

struct VtkArray {
    ScalarType type;
    std::size_t numbers;  // per row
    ByteOrder order;
    std::span<const unsigned char> bytes;
    std::vector<unsigned char> decoded;  // storage for bytes that had to be decoded
};

class VtkFile {
public:
    // `text` must outlive it. Throws Error if the text is not VTK XML of this type, or uses an unknown compressor.
    VtkFile(std::string_view text, std::string_view type);

    const pugi::xml_document& document() const { return document_; }

    // Reads an array of `rows` strings, each terminated by a zero byte. Throws Error if it is missing or too short.
    std::vector<Token> strings(pugi::xml_node node, std::size_t rows) const;

    // Reads an array with `rows` rows. Returns nothing for arrays that can't be attributes: strings, bits, more than 16
    // numbers per row. Throws Error if the array is missing or too short.
    std::optional<VtkArray> array(pugi::xml_node node, std::size_t rows) const;

private:
    // Returns the number of bytes in the array whose data begin here.
    std::size_t bytes_of(std::string_view text, bool base64) const;
    // Returns the data of an array, from the XML or the appended section, and whether they are Base64.
    std::pair<std::string_view, bool> data_of(pugi::xml_node node, std::string_view text) const;
    // Returns the raw bytes in `text`, which follow their count.
    std::span<const unsigned char> raw(std::string_view text, std::size_t needed) const;
    // Returns the same bytes if they are encoded or compressed.
    std::vector<unsigned char> decode(std::string_view text, bool base64, std::size_t needed) const;
    std::size_t header_number(std::span<const unsigned char> bytes, std::size_t index) const;

    pugi::xml_document document_;
    std::string_view appended_;
    bool appended_base64_ = false, wide_header_ = false, compressed_ = false;
    ByteOrder order_ = ByteOrder::Little;
};

constexpr std::string_view xml_space = " \t\r\n";

std::optional<ScalarType> scalar_type(std::string_view name)
{
    static const std::map<std::string_view, ScalarType> types = {
        {"Int8", ScalarType::Int8},     {"UInt8", ScalarType::UInt8},   {"Int16", ScalarType::Int16},
        {"UInt16", ScalarType::UInt16}, {"Int32", ScalarType::Int32},   {"UInt32", ScalarType::UInt32},
        {"Int64", ScalarType::Int64},   {"UInt64", ScalarType::UInt64}, {"Float32", ScalarType::Float},
        {"Float64", ScalarType::Double}};
    const auto found = types.find(name);
    return found == types.end() ? std::nullopt : std::optional(found->second);
}

Error ends_early() { return Error("the array ends early"); }

std::string_view without_space(std::string_view text)
{
    text.remove_prefix(std::min(text.find_first_not_of(xml_space), text.size()));
    return text;
}

// Parses numbers to the machine's binary format.
std::vector<unsigned char> parsed_numbers(std::string_view text, ScalarType type, std::size_t count)
{
    if (count > (text.size() + 1) / 2) throw ends_early();  // a digit each, separated by spaces
    std::vector<unsigned char> bytes(count * scalar_bytes(type));
    with_scalar(type, [&](auto like) {
        using Number = std::conditional_t<std::is_same_v<decltype(like), Half>, float, decltype(like)>;
        for (std::size_t i = 0; i < count; ++i) {
            text = without_space(text);
            Number number = 0;
            const auto parsed = parse_number(text.data(), text.data() + text.size(), number);
            text.remove_prefix(static_cast<std::size_t>(parsed.ptr - text.data()));
            if (parsed.ec != std::errc() || (!text.empty() && xml_space.find(text[0]) == std::string_view::npos))
                throw Error(fmt::format("its number {} is not a number of its type", i));
            std::memcpy(bytes.data() + i * sizeof number, &number, sizeof number);
        }
        if (!without_space(text).empty()) throw Error(fmt::format("the array has more than its {} numbers", count));
    });
    return bytes;
}

// Parses bytes, which other programs write with a sign or without.
std::vector<unsigned char> parsed_bytes(std::string_view text, std::size_t count)
{
    const std::vector<unsigned char> numbers = parsed_numbers(text, ScalarType::Int16, count);
    std::vector<unsigned char> bytes;
    for (std::size_t i = 0; i < count; ++i) {
        const auto number = load_scalar<std::int16_t>(numbers.data() + sizeof(std::int16_t) * i, ByteOrder::Little);
        if (number < -128 || number > 255) throw Error(fmt::format("its number {} is not a byte", i));
        bytes.push_back(static_cast<unsigned char>(number));
    }
    return bytes;
}

// Parses the whole text as an unsigned integer. Returns nothing if it is not one.
std::optional<std::size_t> whole_number(std::string_view text)
{
    std::size_t number = 0;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) return {};
    return number;
}

VtkFile::VtkFile(std::string_view text, std::string_view type)
{
    // The appended section is not XML if it is raw.
    const std::size_t appended = text.find("<AppendedData");
    std::string xml(text.substr(0, appended));
    if (appended != std::string_view::npos) {
        const std::size_t tag_end = text.find('>', appended);
        const std::size_t begin = tag_end == std::string_view::npos ? tag_end : text.find('_', tag_end);
        const std::size_t last = text.find_last_not_of(xml_space);
        if (begin == std::string_view::npos || !text.substr(0, last + 1).ends_with("</VTKFile>"))
            throw Error("the file ends within its AppendedData");
        appended_base64_ = text.substr(appended, tag_end - appended).find("base64") != std::string_view::npos;
        appended_ = text.substr(begin + 1);
        xml += "</VTKFile>";
    }
    const pugi::xml_parse_result parsed = document_.load_buffer(xml.data(), xml.size());
    const pugi::xml_node root = document_.child("VTKFile");
    if (!root) throw Error("not a VTK file: it has no element VTKFile");
    if (!parsed) throw Error(fmt::format("its XML is damaged: {}", parsed.description()));
    if (root.attribute("type").value() != type)
        throw Error(fmt::format("it contains {}; it must contain {}",
                                root.attribute("type").as_string("no type of data"), type));
    if (root.attribute("byte_order").value() == std::string_view("BigEndian")) order_ = ByteOrder::Big;
    wide_header_ = root.attribute("header_type").value() == std::string_view("UInt64");
    const std::string_view compressor = root.attribute("compressor").value();
    compressed_ = !compressor.empty();
    if (compressed_ && compressor != "vtkZLibDataCompressor")
        throw Error(fmt::format("it is compressed by {}; it must be compressed by vtkZLibDataCompressor, or not at all",
                                compressor));
}

std::size_t VtkFile::header_number(std::span<const unsigned char> bytes, std::size_t index) const
{
    if (wide_header_) return load_scalar<std::uint64_t>(bytes.data() + 8 * index, order_);
    return load_scalar<std::uint32_t>(bytes.data() + 4 * index, order_);
}

std::span<const unsigned char> VtkFile::raw(std::string_view text, std::size_t needed) const
{
    const std::size_t header = wide_header_ ? 8 : 4;
    const auto* bytes = reinterpret_cast<const unsigned char*>(text.data());
    if (text.size() < header || header_number({bytes, header}, 0) < needed || needed > text.size() - header)
        throw ends_early();
    return {bytes + header, needed};
}

std::vector<unsigned char> VtkFile::decode(std::string_view text, bool base64, std::size_t needed) const
{
    const std::size_t number = wide_header_ ? 8 : 4;
    // Returns the next bytes. In Base64 the header and the data are encoded separately, and the header as a whole.
    const auto bytes_at = [&](std::size_t count, std::size_t& length) {
        if (base64) return from_base64(text, count, length);
        if (count > text.size()) throw ends_early();
        length = count;
        const auto* begin = reinterpret_cast<const unsigned char*>(text.data());
        return std::vector<unsigned char>(begin, begin + count);
    };
    std::size_t length = 0;
    if (!compressed_) {
        // A byte count, then the data, encoded together.
        if (header_number(bytes_at(number, length), 0) < needed || needed > text.size()) throw ends_early();
        std::vector<unsigned char> bytes = bytes_at(number + needed, length);
        bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(number));
        return bytes;
    }
    // The number of blocks, the size of each and of the last one (0: like the others), then the compressed size of
    // each.
    const std::size_t blocks = header_number(bytes_at(3 * number, length), 0);
    if (blocks > text.size() / number) throw ends_early();
    const std::vector<unsigned char> header = bytes_at((3 + blocks) * number, length);
    text.remove_prefix(length);
    const std::size_t block = header_number(header, 1), last = header_number(header, 2);
    std::size_t packed = 0;
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::size_t bytes = header_number(header, 3 + b);
        if (bytes > text.size()) throw ends_early();
        packed += bytes;
        if (packed > text.size()) throw ends_early();
    }
    if (needed / max_deflate_expansion > packed) throw ends_early();
    const std::vector<unsigned char> data = bytes_at(packed, length);
    if (const auto all = static_cast<double>(needed); !fits_in_memory(all))
        throw memory_exceeded("an array, decompressed,", all, "write fewer points to the file");
    std::vector<unsigned char> result(needed);
    std::size_t from = 0, to = 0;
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::size_t size = b + 1 == blocks && last > 0 ? last : block;
        const std::size_t packed_size = header_number(header, 3 + b);
        if (size > result.size() - to) throw Error("the blocks of the array contain more than its numbers");
        uLongf found = size;
        const int status = ::uncompress(result.data() + to, &found, data.data() + from, packed_size);
        if (status == Z_MEM_ERROR) throw std::bad_alloc();
        if (status != Z_OK || found != size) throw Error("a compressed block of the array is damaged");
        from += packed_size;
        to += size;
    }
    if (to < needed) throw ends_early();
    return result;
}

std::size_t VtkFile::bytes_of(std::string_view text, bool base64) const
{
    const std::size_t number = wide_header_ ? 8 : 4;
    const auto header = [&](std::size_t count) {
        std::size_t length = 0;
        if (base64) return from_base64(text, count * number, length);
        if (count * number > text.size()) throw ends_early();
        const auto* begin = reinterpret_cast<const unsigned char*>(text.data());
        return std::vector<unsigned char>(begin, begin + count * number);
    };
    if (!compressed_) return header_number(header(1), 0);
    const std::vector<unsigned char> sizes = header(3);
    const std::size_t blocks = header_number(sizes, 0), block = header_number(sizes, 1), last = header_number(sizes, 2);
    if (blocks > text.size() / number || block > text.size() * max_deflate_expansion) throw ends_early();
    return blocks == 0 ? 0 : (blocks - 1) * block + (last > 0 ? last : block);
}

std::pair<std::string_view, bool> VtkFile::data_of(pugi::xml_node node, std::string_view text) const
{
    const std::string_view format = node.attribute("format").value();
    if (format == "binary") return {text, true};
    if (format != "appended")
        throw Error(fmt::format("its format is \"{}\"; it must be ascii, binary or appended", format));
    const std::optional<std::size_t> offset = whole_number(node.attribute("offset").value());
    if (!offset || *offset > appended_.size()) throw Error("its offset is beyond the end of the file");
    return {appended_.substr(*offset), appended_base64_};
}

std::vector<Token> VtkFile::strings(pugi::xml_node node, std::size_t rows) const
{
    try {
        const std::string_view text = without_space(node.text().get());
        std::vector<unsigned char> bytes;
        if (node.attribute("format").value() == std::string_view("ascii")) {
            // The bytes are stored as numbers.
            std::size_t count = 0;
            for (std::size_t i = 0; i < text.size(); ++i)
                count += xml_space.find(text[i]) == std::string_view::npos &&
                         (i == 0 || xml_space.find(text[i - 1]) != std::string_view::npos);
            bytes = parsed_bytes(text, count);
        } else {
            const auto [data, base64] = data_of(node, text);
            const std::size_t size = bytes_of(data, base64);
            if (!base64 && !compressed_) {
                const std::span<const unsigned char> in_file = raw(data, size);
                bytes.assign(in_file.begin(), in_file.end());
            } else {
                bytes = decode(data, base64, size);
            }
        }
        std::vector<Token> strings;
        StringTokens token_of_row;
        for (auto at = bytes.begin(); strings.size() < rows;) {
            const auto end = std::find(at, bytes.end(), 0);
            if (end == bytes.end()) throw ends_early();
            strings.push_back(token_of_row(std::string(at, end)));
            at = end + 1;
        }
        return strings;
    } catch (const Error& error) {
        throw Error(
            fmt::format("the array \"{}\" of {} strings: {}", node.attribute("Name").value(), rows, error.what()),
            error.kind());
    }
}

std::optional<VtkArray> VtkFile::array(pugi::xml_node node, std::size_t rows) const
{
    if (!node) throw Error("an array is missing");
    const std::string_view name = node.attribute("Name").value(), format = node.attribute("format").value();
    const std::optional<ScalarType> type = scalar_type(node.attribute("type").value());
    const pugi::xml_attribute components = node.attribute("NumberOfComponents");
    const std::size_t numbers = components ? whole_number(components.value()).value_or(0) : 1;
    if (!type || numbers < 1 || numbers > max_numbers) return {};
    VtkArray array{*type, numbers, order_, {}, {}};
    const std::size_t row = numbers * scalar_bytes(*type);
    try {
        if (rows > (std::size_t{1} << 48)) throw ends_early();
        const std::string_view text = without_space(node.text().get());
        if (format == "ascii") {
            array.decoded = parsed_numbers(text, *type, rows * numbers);
            array.order = ByteOrder::Little;
        } else {
            const auto [data, base64] = data_of(node, text);
            if (!base64 && !compressed_) {
                array.bytes = raw(data, rows * row);
                return array;
            }
            array.decoded = decode(data, base64, rows * row);
        }
    } catch (const Error& error) {
        throw Error(fmt::format("the array \"{}\" of {} rows: {}", name, rows, error.what()), error.kind());
    }
    array.bytes = array.decoded;
    return array;
}

std::string_view vtk_type(AttributeType type)
{
    if (type == AttributeType::String) return "String";
    if (type == AttributeType::Int32) return "Int32";
    return type == AttributeType::Int64 ? "Int64" : "Float32";
}

// Returns the characters that XML cannot represent.
std::string control_characters()
{
    std::string text(' ', '\0');
    std::iota(text.begin(), text.end(), '\0');
    return text;
}

// The XML with a position for the data, and the arrays that belong there.
class VtpWriter {
public:
    explicit VtpWriter(const PointSet& points)
        : points_(points),
          connectivity_(AnyColumn(Column<std::int64_t>(points.size()))),
          offsets_(AnyColumn(Column<std::int64_t>(!points.empty(), static_cast<std::int64_t>(points.size()))))
    {
        const std::span<std::int64_t> indices = std::get<Column<std::int64_t>>(connectivity_).write();
        std::iota(indices.begin(), indices.end(), std::int64_t{0});
    }

    void write(OutputFile& file, const FrameInfo& frame)
    {
        describe(frame);
        std::ostringstream text;
        document_.save(text, "  ");
        const std::string xml = text.str();
        const std::size_t place = xml.rfind("_</AppendedData>") + 1;
        file.append(xml.data(), place);
        std::uint64_t at = file.appended();
        for (const Array& array : arrays_) {
            const std::uint64_t bytes = array.bytes();
            file.write_at(at, &bytes, sizeof bytes);
            if (array.strings)
                write_strings(file, at + sizeof bytes, *array.strings);
            else
                array.records.write(file, at + sizeof bytes, array.size);
            at += sizeof bytes + bytes;
        }
        file.write_at(at, xml.data() + place, xml.size() - place);
    }

private:
    struct Array {
        RecordWriter records;
        std::size_t size;
        const Column<Token>* strings = nullptr;

        std::uint64_t bytes() const
        {
            if (!strings) return records.record_bytes() * size;
            std::uint64_t sum = size;  // a zero byte after each
            for (std::size_t i = 0; i < size; ++i) sum += (*strings)[i].text().size();
            return sum;
        }
    };

    static void write_strings(OutputFile& file, std::uint64_t at, const Column<Token>& strings)
    {
        std::string piece;
        for (std::size_t i = 0; i < strings.size(); ++i) {
            piece += strings[i].text();
            piece += '\0';
            if (i + 1 < strings.size() && piece.size() < (std::size_t{1} << 20)) continue;
            file.write_at(at, piece.data(), piece.size());
            at += piece.size();
            piece.clear();
        }
    }

    void describe(const FrameInfo& frame)
    {
        pugi::xml_node root = document_.append_child("VTKFile");
        root.append_attribute("type") = "PolyData";
        root.append_attribute("version") = "1.0";
        root.append_attribute("byte_order") = "LittleEndian";
        root.append_attribute("header_type") = "UInt64";
        pugi::xml_node data = root.append_child("PolyData");
        pugi::xml_node time = data.append_child("FieldData").append_child("DataArray");
        time.append_attribute("type") = "Float64";
        time.append_attribute("Name") = "TimeValue";
        time.append_attribute("NumberOfTuples") = 1;
        time.append_attribute("format") = "ascii";
        time.text() = fmt::format("{}", frame.time).c_str();

        pugi::xml_node piece = data.append_child("Piece");
        piece.append_attribute("NumberOfPoints") = static_cast<unsigned long long>(points_.size());
        piece.append_attribute("NumberOfVerts") = points_.empty() ? 0 : 1;
        for (const char* other : {"NumberOfLines", "NumberOfStrips", "NumberOfPolys"})
            piece.append_attribute(other) = 0;
        describe_attributes(piece.append_child("PointData"));
        add(piece.append_child("Points"), "P", *points_.find("P"));
        pugi::xml_node verts = piece.append_child("Verts");
        add(verts, "connectivity", connectivity_);
        add(verts, "offsets", offsets_);
        pugi::xml_node appended = root.append_child("AppendedData");
        appended.append_attribute("encoding") = "raw";
        appended.text() = "_";
    }

    void describe_attributes(pugi::xml_node to)
    {
        to.append_attribute("Vectors") = "v";
        if (points_.find<Vec3f>("N")) to.append_attribute("Normals") = "N";
        std::vector<std::string> names = further_attributes(points_);
        names.insert(names.begin(), {"v", "id"});
        for (const std::string& name : names) add(to, name, *points_.find(name));
        for (const auto& [name, members] : points_.groups()) {
            names.push_back(std::string(group_prefix) + name);
            Array& array = add(to, names.back(), "UInt8", 1, points_.size());
            array.records.add_bytes(members);
        }
        check_column_names(names, control_characters());
    }

    void add(pugi::xml_node to, const std::string& name, const AnyColumn& column)
    {
        const std::size_t size = std::visit([](const auto& c) { return c.size(); }, column);
        const AttributeType type = type_of(column);
        Array& array = add(to, name, vtk_type(type), component_count(type), size);
        if ((array.strings = std::get_if<Column<Token>>(&column)) == nullptr) array.records.add(name, column);
    }

    Array& add(pugi::xml_node to, const std::string& name, std::string_view type, std::size_t numbers, std::size_t size)
    {
        if (!arrays_.empty()) {
            const Array& before = arrays_.back();
            offset_ += sizeof(std::uint64_t) + before.bytes();
        }
        pugi::xml_node array = to.append_child(type == "String" ? "Array" : "DataArray");
        array.append_attribute("type") = std::string(type).c_str();
        array.append_attribute("Name") = name.c_str();
        array.append_attribute("NumberOfComponents") = static_cast<unsigned>(numbers);
        if (type == "String") array.append_attribute("NumberOfTuples") = static_cast<unsigned long long>(size);
        array.append_attribute("format") = "appended";
        array.append_attribute("offset") = static_cast<unsigned long long>(offset_);
        return arrays_.emplace_back(Array{RecordWriter(ByteOrder::Little, RecordWriter::Wide), size});
    }

    const PointSet& points_;
    AnyColumn connectivity_, offsets_;  // of the cell
    pugi::xml_document document_;
    std::vector<Array> arrays_;
    std::uint64_t offset_ = 0;  // of the last array, relative to the first one
};

void write_vtp(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    VtpWriter(points).write(file, frame);
}

RecordAttribute attribute_of_array(const std::string& name, const VtkArray& array)
{
    RecordAttribute attribute;
    attribute.type = array.type;
    attribute.group = array.type == ScalarType::UInt8 && array.numbers == 1 && name.starts_with(group_prefix);
    attribute.name = attribute.group ? name.substr(group_prefix.size()) : name;
    for (std::size_t c = 0; c < array.numbers; ++c) attribute.offsets.push_back(c * scalar_bytes(array.type));
    return attribute;
}

Column<Token> text_column(const std::vector<Token>& strings) { return Column<Token>(std::span<const Token>(strings)); }

PointSet read_piece(const VtkFile& vtk, const pugi::xml_node& piece, bool& has_id)
{
    const std::optional<std::size_t> n = whole_number(piece.attribute("NumberOfPoints").value());
    if (!n) throw Error("its piece has no NumberOfPoints");

    PointSet points;
    const auto read = [&](const std::string& name, const VtkArray& array) {
        const RecordAttribute attribute = attribute_of_array(name, array);
        const std::size_t stride = array.numbers * scalar_bytes(array.type);
        read_attribute(points, {array.bytes, *n, stride, array.order}, attribute);
        has_id |= attribute.name == "id" && !attribute.group && array.numbers == 1;
    };
    if (*n > 0) {
        const std::optional<VtkArray> P = vtk.array(piece.child("Points").child("DataArray"), *n);
        if (!P || P->numbers != 3 || !is_floating(P->type))
            throw Error("its Points are not an array of three floats for each point");
        points.append(*n);
        read("P", *P);
    }
    std::vector<std::string> names = {"P"};
    for (const pugi::xml_node node : piece.child("PointData").children("DataArray")) {
        const std::optional<VtkArray> array = vtk.array(node, *n);
        if (!array) {
            SkippedContents::add(fmt::format("the array \"{}\" of the type {}, {} numbers per point",
                                             node.attribute("Name").value(), node.attribute("type").value(),
                                             node.attribute("NumberOfComponents").as_string("1")));
            continue;
        }
        names.emplace_back(node.attribute("Name").value());
        read(names.back(), *array);
    }
    for (const pugi::xml_node node : piece.child("PointData").children("Array")) {
        const std::string name = node.attribute("Name").value();
        if (node.attribute("type").value() != std::string_view("String") ||
            node.attribute("NumberOfComponents").as_uint(1) != 1) {
            SkippedContents::add(fmt::format("the array \"{}\" of the type {}", name, node.attribute("type").value()));
            continue;
        }
        names.push_back(name);
        points.set(name, text_column(vtk.strings(node, *n)));
    }
    for (const auto& [count, what] : {std::pair("NumberOfLines", "lines"), std::pair("NumberOfStrips", "strips"),
                                      std::pair("NumberOfPolys", "polygons")})
        if (const unsigned found = piece.attribute(count).as_uint(); found > 0)
            SkippedContents::add(fmt::format("its {} {}", found, what));
    check_column_names(names, "");
    return points;
}

void append_piece(PointSet& to, const PointSet& from)
{
    const auto same = [](const auto& a, const auto& b) {
        return a.first == b.first && type_of(a.second) == type_of(b.second);
    };
    if (!std::equal(to.columns().begin(), to.columns().end(), from.columns().begin(), from.columns().end(), same) ||
        to.group_names() != from.group_names())
        throw Error("its pieces have different arrays; they must have the same");
    const std::size_t before = to.size();
    append_points(to, from);
    for (const auto& [name, members] : from.groups()) {
        const std::span<std::uint8_t> of_all = to.group(name).write();
        for (std::size_t i = 0; i < from.size(); ++i) of_all[before + i] = members[i];
    }
}

PointSet read_vtp(const std::filesystem::path& path)
{
    const InputFile file(path);
    const VtkFile vtk(file.text(), "PolyData");
    std::optional<PointSet> points;
    bool has_id = false;
    for (const pugi::xml_node& piece : vtk.document().child("VTKFile").child("PolyData").children("Piece")) {
        PointSet of_piece = read_piece(vtk, piece, has_id);
        if (!points || points->empty())
            points = std::move(of_piece);
        else if (!of_piece.empty())
            append_piece(*points, of_piece);
    }
    if (!points) throw Error("the file has no piece");
    if (!has_id) number_points(*points);
    return std::move(*points);
}

RAPID_FORMAT(Format{".vtp", "VTK's points, for ParaView; all types", write_vtp, read_vtp});

}  // namespace
}  // namespace rapid
