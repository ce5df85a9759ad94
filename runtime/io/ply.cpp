// .ply: binary little-endian PLY, one element "vertex".
//
// P is x y z, v is vx vy vz, N is nx ny nz (the names that other programs know), any other vec3 NAMEx NAMEy NAMEz, a
// quaternion also NAMEw; integers are int (an int64 that does not fit is refused); a group is uchar group_NAME.
//
// Reads any PLY, ascii or binary of either byte order, unless elements of variable size come before the vertices;
// red green blue become Cd.
#include <fmt/format.h>

#include <charconv>
#include <cstring>
#include <map>
#include <optional>

#include "runtime/files/input_file.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/records.h"

namespace rapid {
namespace {

constexpr std::string_view group_prefix = "group_";
constexpr std::string_view white_space = " \t\r\n";

// The names of an attribute's components in the file.
std::vector<std::string> ply_names(const std::string& name, const AnyColumn& column)
{
    if (name == "P") return {"x", "y", "z"};
    const std::size_t count = component_count(type_of(column));
    return component_names(name == "N" && count == 3 ? "n" : name, count);
}

std::string_view ply_type(const AnyColumn& column)
{
    const AttributeType type = type_of(column);
    return type == AttributeType::Int32 || type == AttributeType::Int64 ? "int" : "float";
}

void write_ply(OutputFile& file, const PointSet& points, const FrameInfo&)
{
    RecordWriter records(ByteOrder::Little);
    std::vector<std::string> names;
    std::string properties;
    const auto add = [&](const std::string& name) {
        const AnyColumn& column = *points.find(name);
        records.add(name, column);
        for (const std::string& number : ply_names(name, column)) {
            properties += fmt::format("property {} {}\n", ply_type(column), number);
            names.push_back(number);
        }
    };
    for (const char* name : {"P", "v", "id"}) add(name);
    for (const std::string& name : further_attributes(points)) add(name);
    for (const auto& [name, members] : points.groups()) {
        records.add_group(members);
        names.push_back(std::string(group_prefix) + name);
        properties += fmt::format("property uchar {}\n", names.back());
    }
    check_column_names(names, white_space);

    const std::string header = fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment Rapid points, metres and seconds\nelement vertex {}\n{}"
        "end_header\n",
        points.size(), properties);
    file.append(header.data(), header.size());
    records.write(file, file.appended(), points.size());
}

struct PlyProperty {
    std::string name;
    ScalarType type = ScalarType::Float;
    bool list = false;
    ScalarType count_type = ScalarType::UInt8;
};

struct PlyElement {
    std::string name;
    std::size_t count = 0;
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    enum Encoding { Ascii, Little, Big } encoding = Ascii;
    std::vector<PlyElement> elements;
    std::size_t bytes = 0;
};

std::vector<std::string> split(std::string_view line)
{
    std::vector<std::string> words;
    std::size_t begin = 0;
    while ((begin = line.find_first_not_of(white_space, begin)) != std::string_view::npos) {
        const std::size_t end = std::min(line.find_first_of(white_space, begin), line.size());
        words.emplace_back(line.substr(begin, end - begin));
        begin = end;
    }
    return words;
}

ScalarType scalar_type(const std::string& name)
{
    static const std::map<std::string, ScalarType> types = {
        {"char", ScalarType::Int8},     {"int8", ScalarType::Int8},     {"uchar", ScalarType::UInt8},
        {"uint8", ScalarType::UInt8},   {"short", ScalarType::Int16},   {"int16", ScalarType::Int16},
        {"ushort", ScalarType::UInt16}, {"uint16", ScalarType::UInt16}, {"int", ScalarType::Int32},
        {"int32", ScalarType::Int32},   {"uint", ScalarType::UInt32},   {"uint32", ScalarType::UInt32},
        {"float", ScalarType::Float},   {"float32", ScalarType::Float}, {"double", ScalarType::Double},
        {"float64", ScalarType::Double}};
    const auto found = types.find(name);
    if (found == types.end()) throw Error(fmt::format("not a valid PLY file: unknown type \"{}\"", name));
    return found->second;
}

PlyHeader read_header(std::string_view text)
{
    if (!text.starts_with("ply")) throw Error("not a PLY file: it does not begin with \"ply\"");
    PlyHeader header;
    bool formatted = false;
    std::size_t begin = 0;
    for (int line = 1;; ++line) {
        const std::size_t end = text.find('\n', begin);
        if (end == std::string_view::npos) throw Error("not a valid PLY file: its header has no \"end_header\"");
        const std::vector<std::string> words = split(text.substr(begin, end - begin));
        begin = end + 1;
        const auto wrong = [&] {
            return Error(fmt::format("not a valid PLY file: line {} of its header can't be understood", line));
        };
        if (words.empty() || words[0] == "ply" || words[0] == "comment" || words[0] == "obj_info") continue;
        if (words[0] == "end_header") break;
        if (words[0] == "format" && words.size() >= 2) {
            formatted = true;
            if (words[1] == "ascii")
                header.encoding = PlyHeader::Ascii;
            else if (words[1] == "binary_little_endian")
                header.encoding = PlyHeader::Little;
            else if (words[1] == "binary_big_endian")
                header.encoding = PlyHeader::Big;
            else
                throw wrong();
        } else if (words[0] == "element" && words.size() == 3) {
            PlyElement& element = header.elements.emplace_back();
            element.name = words[1];
            const auto parsed = std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
            if (parsed.ec != std::errc() || parsed.ptr != words[2].data() + words[2].size()) throw wrong();
        } else if (words[0] == "property" && words.size() == 3 && !header.elements.empty()) {
            header.elements.back().properties.push_back({words[2], scalar_type(words[1])});
        } else if (words[0] == "property" && words.size() == 5 && words[1] == "list" && !header.elements.empty()) {
            header.elements.back().properties.push_back({words[4], scalar_type(words[3]), true, scalar_type(words[2])});
        } else {
            throw wrong();
        }
    }
    if (!formatted) throw Error("not a valid PLY file: its header has no \"format\"");
    header.bytes = begin;
    return header;
}

// Rapid's name for a property; the components of an attribute share a stem.
std::string rapid_name(const std::string& property)
{
    static const std::map<std::string, std::string> known = {{"x", "Px"},    {"y", "Py"},      {"z", "Pz"},
                                                             {"nx", "Nx"},   {"ny", "Ny"},     {"nz", "Nz"},
                                                             {"red", "Cdx"}, {"green", "Cdy"}, {"blue", "Cdz"}};
    const auto found = known.find(property);
    return found == known.end() ? property : found->second;
}

std::vector<RecordAttribute> attributes_of(const PlyElement& vertex)
{
    std::vector<std::string> names;
    std::vector<std::size_t> offsets;
    std::size_t offset = 0;
    for (const PlyProperty& property : vertex.properties) {
        names.push_back(rapid_name(property.name));
        offsets.push_back(offset);
        offset += scalar_bytes(property.type);
    }
    std::vector<RecordAttribute> attributes;
    for (const JoinedColumns& joined : join_components(names)) {
        const PlyProperty& first = vertex.properties[joined.columns[0]];
        const bool one_type = std::all_of(joined.columns.begin(), joined.columns.end(),
                                          [&](std::size_t c) { return vertex.properties[c].type == first.type; });
        const bool colour = joined.name == "Cd" && first.type == ScalarType::UInt8;
        if (joined.columns.size() == 1 && first.name.starts_with(group_prefix) && first.type == ScalarType::UInt8) {
            attributes.push_back(
                {first.name.substr(group_prefix.size()), first.type, {offsets[joined.columns[0]]}, true});
        } else if (one_type && (joined.columns.size() == 1 || first.type == ScalarType::Float ||
                                first.type == ScalarType::Double || colour)) {
            RecordAttribute& attribute = attributes.emplace_back();
            attribute.name = joined.name;
            attribute.type = first.type;
            attribute.scale = colour ? 1.0 / 255 : 1;
            for (const std::size_t c : joined.columns) attribute.offsets.push_back(offsets[c]);
        } else {
            for (const std::size_t c : joined.columns)
                attributes.push_back({vertex.properties[c].name, vertex.properties[c].type, {offsets[c]}});
        }
    }
    return attributes;
}

// Converts ascii vertices to binary records of the declared types.
std::vector<unsigned char> parse_ascii(std::string_view text, const PlyElement& vertex, std::size_t stride)
{
    std::vector<unsigned char> records(vertex.count * stride);
    unsigned char* to = records.data();
    const char* at = text.data();
    const char* const end = at + text.size();
    for (std::size_t i = 0; i < vertex.count; ++i)
        for (const PlyProperty& property : vertex.properties) {
            while (at != end && white_space.find(*at) != std::string_view::npos) ++at;
            double value = 0;
            const auto parsed = std::from_chars(at, end, value);
            if (parsed.ec != std::errc())
                throw Error(fmt::format("the file ends early or is damaged: vertex {} of {} has no {}", i, vertex.count,
                                        property.name));
            at = parsed.ptr;
            const auto store = [&](auto number) {
                std::memcpy(to, &number, sizeof number);
                to += sizeof number;
            };
            switch (property.type) {
                case ScalarType::Int8:
                    store(static_cast<std::int8_t>(value));
                    break;
                case ScalarType::UInt8:
                    store(static_cast<std::uint8_t>(value));
                    break;
                case ScalarType::Int16:
                    store(static_cast<std::int16_t>(value));
                    break;
                case ScalarType::UInt16:
                    store(static_cast<std::uint16_t>(value));
                    break;
                case ScalarType::Int32:
                    store(static_cast<std::int32_t>(value));
                    break;
                case ScalarType::UInt32:
                    store(static_cast<std::uint32_t>(value));
                    break;
                case ScalarType::Float:
                    store(static_cast<float>(value));
                    break;
                case ScalarType::Double:
                    store(value);
                    break;
            }
        }
    return records;
}

PointSet read_ply(const std::filesystem::path& path)
{
    const InputFile file(path);
    const PlyHeader header = read_header(file.text());

    // Elements of known size before the vertices are skipped.
    std::size_t skipped = header.bytes;
    const PlyElement* vertex = nullptr;
    for (const PlyElement& element : header.elements) {
        std::size_t stride = 0;
        bool lists = false;
        for (const PlyProperty& property : element.properties) {
            lists |= property.list;
            stride += scalar_bytes(property.type);
        }
        if (element.name == "vertex") {
            if (lists) throw Error("vertices with list properties can't be read");
            vertex = &element;
            break;
        }
        if (lists || header.encoding == PlyHeader::Ascii)
            throw Error(fmt::format("the element \"{}\" before the vertices can't be passed over", element.name));
        skipped += stride * element.count;
    }
    if (!vertex) throw Error("the PLY file has no element \"vertex\"");

    std::size_t stride = 0;
    for (const PlyProperty& property : vertex->properties) stride += scalar_bytes(property.type);
    const std::vector<RecordAttribute> attributes = attributes_of(*vertex);
    const bool placed = std::any_of(attributes.begin(), attributes.end(),
                                    [](const RecordAttribute& a) { return a.name == "P" && a.offsets.size() == 3; });
    if (!placed) throw Error("the vertices have no x y z");

    if (header.encoding == PlyHeader::Ascii) {
        if (vertex->count > file.bytes().size()) throw Error("the file ends before its last vertex");
        const std::vector<unsigned char> records = parse_ascii(file.text().substr(skipped), *vertex, stride);
        return read_records(records, vertex->count, stride, ByteOrder::Little, attributes);
    }
    const std::size_t held = file.bytes().size() < skipped ? 0 : file.bytes().size() - skipped;
    if (vertex->count > held / stride)
        throw Error(fmt::format("the file ends early: its header promises {} vertices, it holds {}", vertex->count,
                                held / stride));
    return read_records(file.bytes().subspan(skipped), vertex->count, stride,
                        header.encoding == PlyHeader::Big ? ByteOrder::Big : ByteOrder::Little, attributes);
}

RAPID_FORMAT(Format{".ply", "binary PLY: points for viewers and mesh tools; id as int32", write_ply, read_ply});

}  // namespace
}  // namespace rapid
