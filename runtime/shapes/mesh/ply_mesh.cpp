// Reads meshes from PLY files. The element "vertex" has x y z, optionally red green blue (alpha), and any other
// numbers: nx ny nz becomes N, NAMEx NAMEy NAMEz a vec3, the rest floats. The element "face" has a list of indices,
// vertex_indices or vertex_index; its numbers are read in the same way, and uchar group_NAME is a group of faces if it
// is 0 or 1. The element "tristrips" has lists of strips, which end with -1. Other lists and elements are ignored.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "runtime/base/error.h"
#include "runtime/files/input_file.h"
#include "runtime/files/ply_file.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/shapes/mesh/mesh_file.h"
#include "runtime/shapes/mesh/polygon.h"

namespace rapid {
namespace {

// A column of the vertices, as floats.
class Property {
public:
    Property() = default;  // reads as missing
    Property(const PlyProperty& property, std::size_t offset, const PlyRecords& records, bool colour)
        : records_(&records), offset_(offset), type_(property.type)
    {
        if (colour) scale_ = colour_scale(type_);
    }

    explicit operator bool() const { return records_ != nullptr; }
    float operator[](std::size_t i) const
    {
        return with_scalar(type_, [&](auto like) {
            const unsigned char* from = records_->bytes.data() + i * records_->stride + offset_;
            const auto number = load_scalar<decltype(like)>(from, records_->order);
            return static_cast<float>(scale_ * static_cast<double>(number));
        });
    }

private:
    const PlyRecords* records_ = nullptr;
    std::size_t offset_ = 0;  // in a record
    ScalarType type_ = ScalarType::Float;
    double scale_ = 1;
};

// The properties of an element without lists, by index.
class Properties {
public:
    Properties(const PlyElement& element, const PlyRecords& records) : element_(element), records_(records)
    {
        std::size_t offset = 0;
        for (const PlyProperty& property : element.properties) {
            offsets_.push_back(offset);
            offset += scalar_bytes(property.type);
        }
    }

    Property operator[](std::size_t index) const { return at(index, false); }
    Property find(std::string_view name, bool colour = false) const
    {
        for (std::size_t index = 0; index < offsets_.size(); ++index)
            if (element_.properties[index].name == name) return at(index, colour);
        return {};
    }

private:
    Property at(std::size_t index, bool colour) const
    {
        return {element_.properties[index], offsets_[index], records_, colour};
    }

    const PlyElement& element_;
    const PlyRecords& records_;
    std::vector<std::size_t> offsets_;
};

// Returns true for properties that are read separately.
bool is_known(const std::string& name)
{
    static const std::set<std::string> names = {"x", "y", "z", "red", "green", "blue", "alpha"};
    return names.count(name) != 0;
}

// Returns the name of the vec3 whose components are this property and the next two, NAMEx NAMEy NAMEz; nx ny nz is N.
// Empty if they do not form one.
std::string vec3_name(const std::vector<PlyProperty>& properties, std::size_t at)
{
    const std::string& first = properties[at].name;
    if (first.size() < 2 || at + 2 >= properties.size()) return "";
    const std::string stem = first.substr(0, first.size() - 1);
    for (std::size_t c = 0; c < 3; ++c) {
        const PlyProperty& property = properties[at + c];
        if (property.name != stem + "xyz"[c] || !is_floating(property.type)) return "";
    }
    return stem == "n" ? "N" : stem;
}

void read_values(const PlyElement& vertex, const Properties& values_of, MeshFile& mesh)
{
    const std::vector<PlyProperty>& properties = vertex.properties;
    for (std::size_t p = 0; p < properties.size(); ++p) {
        if (is_known(properties[p].name)) continue;
        if (const std::string name = vec3_name(properties, p); !name.empty()) {
            const Property x = values_of[p], y = values_of[p + 1], z = values_of[p + 2];
            std::vector<Vec3f> values;
            values.reserve(vertex.count);
            for (std::size_t i = 0; i < vertex.count; ++i) values.emplace_back(x[i], y[i], z[i]);
            mesh.values.emplace(name, std::move(values));
            p += 2;
        } else {
            const Property number = values_of[p];
            std::vector<float> values(vertex.count);
            for (std::size_t i = 0; i < vertex.count; ++i) values[i] = number[i];
            mesh.values.emplace(properties[p].name, std::move(values));
        }
    }
}

void read_vertices(PlyFile& file, const PlyElement& element, MeshFile& mesh)
{
    const PlyElement vertex = element.without_lists();
    for (const PlyProperty& property : element.properties)
        if (property.list) add_skipped(mesh.skipped, fmt::format("the list \"{}\" of its vertices", property.name));
    if (vertex.count > std::numeric_limits<std::int32_t>::max())
        throw Error(fmt::format("{} vertices are too many for a mesh", vertex.count));
    const PlyRecords records = file.read_records(element);
    const Properties properties(vertex, records);
    const Property x = properties.find("x"), y = properties.find("y"), z = properties.find("z");
    if (!x || !y || !z) throw Error("the vertices have no x y z");
    mesh.positions.reserve(vertex.count);
    for (std::size_t i = 0; i < vertex.count; ++i) mesh.positions.emplace_back(x[i], y[i], z[i]);
    read_values(vertex, properties, mesh);

    const Property red = properties.find("red", true), green = properties.find("green", true),
                   blue = properties.find("blue", true), alpha = properties.find("alpha", true);
    if (!red || !green || !blue) return;
    mesh.alphas.assign(vertex.count, 1);
    mesh.colours.reserve(vertex.count);
    for (std::size_t i = 0; i < vertex.count; ++i) mesh.colours.emplace_back(red[i], green[i], blue[i]);
    if (alpha)
        for (std::size_t i = 0; i < vertex.count; ++i) mesh.alphas[i] = alpha[i];
}

constexpr std::string_view group_prefix = "group_";

// Reads the values of the faces, row by row.
class FaceValues {
public:
    FaceValues(const PlyElement& face, std::size_t indices, MeshFile& mesh) : mesh_(mesh)
    {
        std::vector<PlyProperty> numbers;  // without lists, so that vectors are consecutive
        std::vector<std::size_t> property_indices;
        for (std::size_t p = 0; p < face.properties.size(); ++p) {
            const PlyProperty& property = face.properties[p];
            if (p != indices && property.list)
                add_skipped(mesh.skipped, fmt::format("the list \"{}\" of its faces", property.name));
            if (property.list) continue;
            numbers.push_back(property);
            property_indices.push_back(p);
        }
        for (std::size_t k = 0; k < numbers.size(); ++k) {
            const PlyProperty& property = numbers[k];
            if (property.name == "red" && k + 2 < numbers.size() && numbers[k + 1].name == "green" &&
                numbers[k + 2].name == "blue") {
                add("Cd", {property_indices[k], property_indices[k + 1], property_indices[k + 2]},
                    colour_scale(property.type));
                k += 2;
            } else if (const std::string name = vec3_name(numbers, k); !name.empty()) {
                add(name, {property_indices[k], property_indices[k + 1], property_indices[k + 2]}, 1);
                k += 2;
            } else {
                add(property.name, {property_indices[k]}, 1);
            }
        }
    }

    // Appends the values of the current row once per triangle.
    void append(const PlyFile& file, std::size_t triangles)
    {
        for (const Part& part : parts_) {
            const auto number = [&](std::size_t c) {
                return static_cast<float>(part.scale * file.number_of_row(part.property_indices[c]));
            };
            if (auto* floats = std::get_if<std::vector<float>>(part.values))
                floats->insert(floats->end(), triangles, number(0));
            else
                std::get<std::vector<Vec3f>>(*part.values)
                    .insert(std::get<std::vector<Vec3f>>(*part.values).end(), triangles,
                            Vec3f(number(0), number(1), number(2)));
        }
    }

    // Turns numbers of groups that are 0 or 1 into groups. Those of other programs may be indices.
    void finish(const PlyElement& face)
    {
        for (const PlyProperty& property : face.properties) {
            const auto found = mesh_.face_values.find(property.name);
            if (property.type != ScalarType::UInt8 || !property.name.starts_with(group_prefix) ||
                found == mesh_.face_values.end())
                continue;
            const auto& numbers = std::get<std::vector<float>>(found->second);
            if (std::any_of(numbers.begin(), numbers.end(), [](float number) { return number > 1; })) continue;
            mesh_.face_groups[property.name.substr(group_prefix.size())].assign(numbers.begin(), numbers.end());
            mesh_.face_values.erase(found);
        }
    }

private:
    struct Part {
        Mesh::VertexValues* values;
        std::vector<std::size_t> property_indices;
        double scale;
    };
    void add(const std::string& name, std::vector<std::size_t> property_indices, double scale)
    {
        Mesh::VertexValues& values = mesh_.face_values[name];
        if (property_indices.size() == 3) values = std::vector<Vec3f>();
        parts_.push_back({&values, std::move(property_indices), scale});
    }

    MeshFile& mesh_;
    std::vector<Part> parts_;
};

// Returns the property that holds the vertices of faces.
std::size_t index_list(const PlyElement& faces)
{
    const auto indices = std::find_if(faces.properties.begin(), faces.properties.end(), [](const PlyProperty& p) {
        return p.list && (p.name == "vertex_indices" || p.name == "vertex_index");
    });
    if (indices == faces.properties.end())
        throw Error(fmt::format("the {} have no list vertex_indices",
                                faces.name == "face" ? std::string("faces") : faces.name));
    return static_cast<std::size_t>(indices - faces.properties.begin());
}

void read_faces(PlyFile& file, const PlyElement& face, MeshFile& mesh)
{
    const auto vertices = static_cast<std::int64_t>(mesh.positions.size());
    std::size_t row = 0;
    std::vector<std::int32_t> corners;
    const std::size_t index = index_list(face);
    FaceValues values(face, index, mesh);
    PolygonCutter cutter;
    file.read_lists(face, index, [&](std::span<const std::int64_t> list) {
        corners.clear();
        for (const std::int64_t corner : list) {
            if (corner < 0 || corner >= vertices)
                throw Error(
                    fmt::format("face {} has the vertex {}; the mesh has {}, numbered from 0", row, corner, vertices));
            corners.push_back(static_cast<std::int32_t>(corner));
        }
        // A face with one or two corners is a point or a line and has no surface.
        const std::size_t before = mesh.triangles.size();
        if (corners.size() >= 3 && !cutter.append(mesh.positions, corners, mesh.triangles))
            throw Error(fmt::format("face {} has {} corners in a line too winding to be cut into triangles; divide it",
                                    row, corners.size()));
        values.append(file, mesh.triangles.size() - before);
        ++row;
    });
    values.finish(face);
}

// Appends the triangles of strips. Every second one is turned.
void read_strips(PlyFile& file, const PlyElement& strips, MeshFile& mesh)
{
    const std::size_t indices = index_list(strips);
    const auto vertices = static_cast<std::int64_t>(mesh.positions.size());
    file.read_lists(strips, indices, [&](std::span<const std::int64_t> list) {
        std::size_t first = 0;  // of the current strip
        for (std::size_t k = 0; k < list.size(); ++k) {
            if (list[k] == -1) {
                first = k + 1;
                continue;
            }
            if (list[k] < 0 || list[k] >= vertices)
                throw Error(
                    fmt::format("a strip has the vertex {}; the mesh has {}, numbered from 0", list[k], vertices));
            if (k < first + 2) continue;
            const auto corner = [&](std::size_t back) { return static_cast<std::int32_t>(list[k - back]); };
            if ((k - first) % 2 == 0)
                mesh.triangles.emplace_back(corner(2), corner(1), corner(0));
            else
                mesh.triangles.emplace_back(corner(1), corner(2), corner(0));
        }
    });
}

void skip_others(const std::vector<PlyElement>& elements, MeshFile& mesh)
{
    for (const PlyElement& element : elements)
        if (element.name != "vertex" && element.name != "face" && element.name != "tristrips" && element.count > 0)
            add_skipped(mesh.skipped, fmt::format("the {} elements \"{}\"", element.count, element.name));
}

}  // namespace

MeshFile read_ply_mesh(const std::filesystem::path& path)
{
    const InputFile input(path);
    PlyFile file(input.text());
    MeshFile mesh;
    bool has_vertices = false, has_faces = false;
    for (const PlyElement& element : file.elements()) {
        if (element.name == "vertex" && !has_vertices) {
            read_vertices(file, element, mesh);
            has_vertices = true;
        } else if (element.name == "face" && !has_faces) {
            if (!has_vertices) throw Error("the faces come before the vertices");
            read_faces(file, element, mesh);
            has_faces = true;
        } else if (element.name == "tristrips" && !has_faces && has_vertices) {
            read_strips(file, element, mesh);
            has_faces = true;
        } else {
            file.pass_over(element);
        }
    }
    if (has_faces) skip_others(file.elements(), mesh);
    if (file.ends_within_number()) add_note(mesh.skipped, no_last_newline);
    return mesh;
}

}  // namespace rapid
