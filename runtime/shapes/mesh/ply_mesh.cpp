// Meshes from PLY files: the element "vertex" with x y z and, where there are some, red green blue (alpha), and any
// other number: nx ny nz is N, NAMEx NAMEy NAMEz a vec3, the others are floats; the element "face" with a list of
// indices, vertex_indices or vertex_index. Other properties of faces are left out.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "runtime/error.h"
#include "runtime/files/input_file.h"
#include "runtime/files/ply_file.h"
#include "runtime/shapes/mesh/mesh_file.h"
#include "runtime/shapes/mesh/polygon.h"

namespace rapid {
namespace {

// A column of the vertices, as floats; colours of integers are parts of the largest.
class Property {
public:
    Property(const PlyElement& vertex, const PlyRecords& records, std::string_view name, bool colour)
        : records_(records)
    {
        for (const PlyProperty& property : vertex.properties) {
            if (property.name == name) {
                found_ = true;
                type_ = property.type;
                if (colour && !is_floating(property.type))
                    scale_ = with_scalar(property.type, [](auto like) {
                        return 1 / static_cast<double>(std::numeric_limits<decltype(like)>::max());
                    });
                return;
            }
            offset_ += scalar_bytes(property.type);
        }
    }

    explicit operator bool() const { return found_; }
    float operator[](std::size_t i) const
    {
        return with_scalar(type_, [&](auto like) {
            const unsigned char* from = records_.bytes.data() + i * records_.stride + offset_;
            const auto number = load_scalar<decltype(like)>(from, records_.order);
            return static_cast<float>(scale_ * static_cast<double>(number));
        });
    }

private:
    const PlyRecords& records_;
    bool found_ = false;
    std::size_t offset_ = 0;  // in a record
    ScalarType type_ = ScalarType::Float;
    double scale_ = 1;
};

// What is read apart from the others, or is none of a vertex alone.
bool is_known(const std::string& name)
{
    static const std::set<std::string> names = {"x", "y", "z", "red", "green", "blue", "alpha"};
    return names.count(name) != 0;
}

// The name of a vec3 whose components are this property and the two after it, NAMEx NAMEy NAMEz; nx ny nz is N. Empty
// where they are none.
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

void read_values(const PlyElement& vertex, const PlyRecords& records, MeshFile& mesh)
{
    const std::vector<PlyProperty>& properties = vertex.properties;
    for (std::size_t p = 0; p < properties.size(); ++p) {
        if (is_known(properties[p].name)) continue;
        const auto values_of = [&](std::size_t property) {
            return Property(vertex, records, properties[property].name, false);
        };
        if (const std::string name = vec3_name(properties, p); !name.empty()) {
            const Property x = values_of(p), y = values_of(p + 1), z = values_of(p + 2);
            std::vector<Vec3f> values;
            values.reserve(vertex.count);
            for (std::size_t i = 0; i < vertex.count; ++i) values.emplace_back(x[i], y[i], z[i]);
            mesh.values.emplace(name, std::move(values));
            p += 2;
        } else {
            const Property number = values_of(p);
            std::vector<float> values(vertex.count);
            for (std::size_t i = 0; i < vertex.count; ++i) values[i] = number[i];
            mesh.values.emplace(properties[p].name, std::move(values));
        }
    }
}

void read_vertices(PlyFile& file, const PlyElement& vertex, MeshFile& mesh)
{
    if (vertex.has_lists()) throw Error("vertices with list properties can't be read");
    if (vertex.count > std::numeric_limits<std::int32_t>::max())
        throw Error(fmt::format("{} vertices are more than a mesh can have", vertex.count));
    const PlyRecords records = file.read_records(vertex);
    const auto property = [&](std::string_view name, bool colour = false) {
        return Property(vertex, records, name, colour);
    };
    const Property x = property("x"), y = property("y"), z = property("z");
    if (!x || !y || !z) throw Error("the vertices have no x y z");
    mesh.positions.reserve(vertex.count);
    for (std::size_t i = 0; i < vertex.count; ++i) mesh.positions.emplace_back(x[i], y[i], z[i]);
    read_values(vertex, records, mesh);

    const Property red = property("red", true), green = property("green", true), blue = property("blue", true),
                   alpha = property("alpha", true);
    if (!red || !green || !blue) return;
    mesh.alphas.assign(vertex.count, 1);
    mesh.colours.reserve(vertex.count);
    for (std::size_t i = 0; i < vertex.count; ++i) mesh.colours.emplace_back(red[i], green[i], blue[i]);
    if (alpha)
        for (std::size_t i = 0; i < vertex.count; ++i) mesh.alphas[i] = alpha[i];
}

void read_faces(PlyFile& file, const PlyElement& face, MeshFile& mesh)
{
    const auto indices = std::find_if(face.properties.begin(), face.properties.end(), [](const PlyProperty& p) {
        return p.list && (p.name == "vertex_indices" || p.name == "vertex_index");
    });
    if (indices == face.properties.end()) throw Error("the faces have no list vertex_indices");
    const auto vertices = static_cast<std::int64_t>(mesh.positions.size());
    std::size_t row = 0;
    std::vector<std::int32_t> corners;
    file.read_lists(
        face, static_cast<std::size_t>(indices - face.properties.begin()), [&](std::span<const std::int64_t> list) {
            corners.clear();
            for (const std::int64_t corner : list) {
                if (corner < 0 || corner >= vertices)
                    throw Error(fmt::format("face {} has the vertex {}; there are {}, from 0", row, corner, vertices));
                corners.push_back(static_cast<std::int32_t>(corner));
            }
            // Of one or two corners it is a point or a line, which has no surface.
            if (corners.size() >= 3) append_polygon(mesh.positions, corners, mesh.triangles);
            ++row;
        });
}

}  // namespace

MeshFile read_ply_mesh(const std::filesystem::path& path)
{
    const InputFile input(path);
    PlyFile file(input.text());
    MeshFile mesh;
    bool placed = false;
    for (const PlyElement& element : file.elements()) {
        if (element.name == "vertex" && !placed) {
            read_vertices(file, element, mesh);
            placed = true;
        } else if (element.name == "face" && placed) {
            read_faces(file, element, mesh);
            return mesh;
        } else if (element.name == "face") {
            throw Error("the faces are before the vertices");
        } else {
            file.pass_over(element);
        }
    }
    return mesh;
}

}  // namespace rapid
