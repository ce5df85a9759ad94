// .ply: binary little-endian PLY, an element "vertex".
//
// P is x y z, v is vx vy vz, N is nx ny nz (the names that other programs know), any other vec3 NAMEx NAMEy NAMEz, and
// a quaternion also NAMEw. Integers are int (an int64 that does not fit is refused). A group is uchar group_NAME. Lines
// (points/trail.h) are elements "edge" with vertex1 and vertex2. Cd is also uchar red green blue, and Alpha also
// uchar alpha: other programs show only these.
//
// Reads any PLY (files/ply_file.h). Without Cd red green blue become Cd, and without Alpha alpha becomes Alpha. Lists
// are skipped.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "runtime/base/parallel.h"
#include "runtime/files/input_file.h"
#include "runtime/files/ply_file.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/records.h"
#include "runtime/points/trail.h"

namespace rapid {
namespace {

constexpr std::string_view white_space = " \t\r\n";

// Returns the names of an attribute's components in the file.
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

// Returns values from 0 to 1 as 0 to 255. Values beyond are clamped, and NaN is 0.
template <class T, class Component>
Column<std::uint8_t> colour_bytes(const Column<T>& column, const Component& component)
{
    const auto byte = [&](const T& value) {
        const float part = component(value);
        return static_cast<std::uint8_t>(part > 0 ? std::min(part, 1.0f) * 255 + 0.5f : 0);
    };
    Column<std::uint8_t> bytes(column.size(), column.size() > 0 ? byte(column[0]) : std::uint8_t{0});
    if (column.is_uniform()) return bytes;
    const std::span<std::uint8_t> to = bytes.overwrite();
    for_each_chunk(column.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = byte(column[i]);
    });
    return bytes;
}

// Returns the colours by the names that other programs know. An attribute of the set may have such a name itself.
std::vector<std::pair<std::string, Column<std::uint8_t>>> shown_colours(const PointSet& points)
{
    std::vector<std::pair<std::string, Column<std::uint8_t>>> shown;
    const bool taken = points.has("red") || points.has("green") || points.has("blue");
    constexpr const char* names[] = {"red", "green", "blue"};
    if (const auto* Cd = points.find<Vec3f>("Cd"); Cd && !taken)
        for (int c = 0; c < 3; ++c)
            shown.emplace_back(names[c], colour_bytes(*Cd, [c](const Vec3f& rgb) { return rgb[c]; }));
    if (const auto* Alpha = points.find<float>("Alpha"); Alpha && !points.has("alpha"))
        shown.emplace_back("alpha", colour_bytes(*Alpha, [](float alpha) { return alpha; }));
    return shown;
}

// Returns the elements "edge". Each connects two neighbours on a line.
std::string edge_section(const PointLines& lines)
{
    std::string section;
    const auto put = [&](std::uint32_t vertex) {
        for (int byte = 0; byte < 4; ++byte) section += static_cast<char>(vertex >> 8 * byte & 0xff);
    };
    std::size_t first = 0;
    for (const std::uint32_t size : lines.sizes) {
        for (std::size_t k = first; k + 1 < first + size; ++k) put(lines.vertices[k]), put(lines.vertices[k + 1]);
        first += size;
    }
    return section;
}

void write_ply(OutputFile& file, const PointSet& given, const FrameInfo&)
{
    const PointLines lines = with_lines(given);
    const PointSet& points = lines.points;
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
    const auto add_bytes = [&](const std::string& name, const Column<std::uint8_t>& bytes) {
        records.add_bytes(bytes);
        names.push_back(name);
        properties += fmt::format("property uchar {}\n", name);
    };
    for (const auto& [name, members] : points.groups()) add_bytes(std::string(group_prefix) + name, members);
    const auto colours = shown_colours(points);
    for (const auto& [name, bytes] : colours) add_bytes(name, bytes);
    check_column_names(names, white_space);

    const std::string edges = edge_section(lines);
    constexpr std::size_t edge_bytes = 8;
    const std::string edges_of_header =
        edges.empty()
            ? ""
            : fmt::format("element edge {}\nproperty int vertex1\nproperty int vertex2\n", edges.size() / edge_bytes);
    const std::string header = fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment Rapid points, metres and seconds\nelement vertex {}\n{}{}"
        "end_header\n",
        points.size(), properties, edges_of_header);
    file.append(header.data(), header.size());
    records.write(file, file.appended(), points.size());
    file.write_at(file.appended() + records.record_bytes() * points.size(), edges.data(), edges.size());
}

// Returns Rapid's name for a property. The components of an attribute share a stem.
std::string rapid_name(const std::string& property)
{
    static const std::map<std::string, std::string> known = {
        {"x", "Px"},  {"y", "Py"},    {"z", "Pz"},      {"nx", "Nx"},    {"ny", "Ny"},
        {"nz", "Nz"}, {"red", "Cdx"}, {"green", "Cdy"}, {"blue", "Cdz"}, {"alpha", "Alpha"}};
    const auto found = known.find(property);
    return found == known.end() ? property : found->second;
}

bool is_membership(const Records& records, std::size_t offset)
{
    for (std::size_t i = 0; i < records.points; ++i)
        if (records.bytes[i * records.stride + offset] > 1) return false;
    return true;
}

std::vector<RecordAttribute> attributes_of(const PlyElement& vertex, const Records& records)
{
    std::set<std::string_view> in_file;
    for (const PlyProperty& property : vertex.properties) in_file.insert(property.name);
    std::vector<std::string> names;
    std::vector<const PlyProperty*> properties;
    std::vector<std::size_t> offsets;
    std::size_t offset = 0;
    for (const PlyProperty& property : vertex.properties) {
        const std::string name = rapid_name(property.name);
        // Rapid writes colours as floats and as bytes. The floats are exact.
        const bool is_colour = name != property.name && (name.starts_with("Cd") || name == "Alpha");
        const bool has_floats = is_colour && in_file.count(name) > 0;
        if (!has_floats || property.type != ScalarType::UInt8) {
            names.push_back(has_floats ? property.name : name);
            properties.push_back(&property);
            offsets.push_back(offset);
        }
        offset += scalar_bytes(property.type);
    }
    std::vector<RecordAttribute> attributes;
    for (const JoinedColumns& joined : join_components(names)) {
        const PlyProperty& first = *properties[joined.columns[0]];
        const bool one_type = std::all_of(joined.columns.begin(), joined.columns.end(),
                                          [&](std::size_t c) { return properties[c]->type == first.type; });
        const bool single = joined.columns.size() == 1;
        const bool is_alpha = first.name == "alpha" && joined.name == "Alpha";
        const bool colour = is_alpha || (first.name == "red" && !single);
        if (one_type && (single || is_floating(first.type) || colour)) {
            RecordAttribute& attribute = attributes.emplace_back();
            attribute.name = single && !is_alpha ? first.name : joined.name;
            attribute.type = first.type;
            attribute.scale = colour ? colour_scale(first.type) : 1;
            for (const std::size_t c : joined.columns) attribute.offsets.push_back(offsets[c]);
            // Other programs number groups: only a number that is 0 or 1 for all points is a group of Rapid.
            attribute.group = first.name.starts_with(group_prefix) && first.type == ScalarType::UInt8 &&
                              is_membership(records, attribute.offsets[0]);
            if (attribute.group) attribute.name.erase(0, group_prefix.size());
        } else {
            for (const std::size_t c : joined.columns)
                attributes.push_back({properties[c]->name, properties[c]->type, {offsets[c]}});
        }
    }
    return attributes;
}

PointSet read_vertices(PlyFile& file, const PlyElement& element)
{
    const PlyElement vertex = element.without_lists();
    std::vector<std::string> names;
    for (const PlyProperty& property : vertex.properties) names.push_back(property.name);
    check_column_names(names, "");
    for (const PlyProperty& property : element.properties)
        if (property.list) SkippedContents::add(fmt::format("the list \"{}\" of its vertices", property.name));
    const PlyRecords rows = file.read_records(element);
    const Records records{rows.bytes, vertex.count, rows.stride, rows.order};
    const std::vector<RecordAttribute> attributes = attributes_of(vertex, records);
    const bool placed = std::any_of(attributes.begin(), attributes.end(),
                                    [](const RecordAttribute& a) { return a.name == "P" && a.offsets.size() == 3; });
    if (!placed) throw Error("the vertices have no x y z");
    return read_records(records, attributes);
}

PointSet read_ply(const std::filesystem::path& path)
{
    const InputFile input(path);
    PlyFile file(input.text());
    std::optional<PointSet> points;
    for (const PlyElement& element : file.elements()) {
        if (element.name == "vertex" && !points)
            points = read_vertices(file, element);
        else
            file.pass_over(element);
    }
    if (!points) throw Error("the PLY file has no element \"vertex\"");
    if (file.ends_within_number()) SkippedContents::note(no_last_newline);
    const bool has_trails = points->find_group(trail_places_group) != nullptr;  // the points define the trails
    for (const PlyElement& element : file.elements())
        if (element.name != "vertex" && element.count > 0 && !(has_trails && element.name == "edge"))
            SkippedContents::add(fmt::format("its {} elements \"{}\"", element.count, element.name));
    return without_trail_places(std::move(*points));
}

RAPID_FORMAT(Format{".ply", "binary PLY: points for viewers and mesh tools; id as int32; no strings", write_ply,
                    read_ply,
                    /*film=*/false, /*positions_only=*/false, /*holds_strings=*/false});

}  // namespace
}  // namespace rapid
