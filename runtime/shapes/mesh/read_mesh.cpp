// Reads mesh files: selects the reader, checks its result, merges vertices by position, and drops faces without area.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <unordered_map>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/files/input_file.h"
#include "runtime/shapes/mesh/detailed_mesh.h"
#include "runtime/shapes/mesh/mesh_file.h"

namespace rapid {
namespace {

std::string lower_case(std::string text)
{
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

MeshFile read_any(const std::filesystem::path& path, const std::string& extension)
{
    if (extension == ".obj") return read_obj_mesh(path);
    if (extension == ".ply") return read_ply_mesh(path);
    if (extension == ".stl") return read_stl_mesh(path);
    return read_gltf_mesh(path);
}

void check(const MeshFile& file)
{
    const auto vertices = static_cast<std::int64_t>(file.positions.size());
    for (const Mesh::Triangle& t : file.triangles)
        if (t.minCoeff() < 0 || t.maxCoeff() >= vertices)
            throw Error(fmt::format("a face has the vertices {}, {} and {}; the mesh has {}, numbered from 0", t[0],
                                    t[1], t[2], vertices));
}

// Returns true if corners of the same vertex have different values.
template <class T>
bool differ_at_vertices(const std::vector<T>& of_corners, const std::vector<std::int32_t>& vertex_of,
                        const std::vector<std::size_t>& first_corners)
{
    for (std::size_t i = 0; i < of_corners.size(); ++i)
        if (of_corners[i] != of_corners[first_corners[static_cast<std::size_t>(vertex_of[i])]]) return true;
    return false;
}

template <class T>
std::vector<T> selected(const std::vector<T>& values, const std::vector<std::size_t>& indices)
{
    std::vector<T> result;
    result.reserve(indices.size());
    for (const std::size_t index : indices) result.push_back(values[index]);
    return result;
}

}  // namespace

std::size_t GroupsOfFaces::add_names(std::set<std::string> names)
{
    names.erase("");
    names_.push_back(std::move(names));
    return names_.size() - 1;
}

void GroupsOfFaces::add_to(MeshFile& mesh) const
{
    const std::size_t triangles = mesh.triangles.size();
    std::set<std::string> all;
    for (const std::set<std::string>& names : names_) all.insert(names.begin(), names.end());
    const double bytes = static_cast<double>(all.size()) * static_cast<double>(triangles);
    if (!fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("{} groups of {} triangles", all.size(), triangles), bytes, "split the file");
    for (const std::string& name : all) mesh.face_groups[name].assign(triangles, 0);
    for (std::size_t f = 0; f < triangles; ++f)
        for (const std::string& name : names_[names_of_triangles_[f]]) mesh.face_groups[name][f] = 1;
}

MeshFile read_mesh_file(const std::filesystem::path& path)
{
    if (std::error_code none; !std::filesystem::exists(path, none))
        throw Error(fmt::format("there is no mesh file \"{}\"", path.string()));
    static const std::vector<std::string> extensions{".obj", ".ply", ".stl", ".gltf", ".glb"};
    const std::string extension = lower_case(without_gz(path).extension().string());
    if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end())
        throw Error(
            fmt::format("\"{}\" can't be read as a mesh; it must be .obj, .ply, .stl, .gltf or .glb", path.string()));

    MeshFile file;
    try {
        file = read_any(path, extension);
        check(file);
    } catch (const Error& error) {
        throw Error(fmt::format("cannot read the mesh \"{}\": {}", path.string(), error.message()), error.kind());
    }
    for (std::size_t i = 0; i < file.positions.size(); ++i)
        if (!file.positions[i].allFinite())
            throw Error(fmt::format("vertex {} of the mesh \"{}\" is at ({}, {}, {}); coordinates must be finite", i,
                                    path.string(), file.positions[i].x(), file.positions[i].y(),
                                    file.positions[i].z()));
    return file;
}

std::vector<std::int32_t> join_by_position(const std::vector<Vec3f>& positions)
{
    struct Hash {
        std::size_t operator()(const std::array<std::uint32_t, 3>& bits) const
        {
            std::uint64_t hash = 0;
            for (const std::uint32_t word : bits) hash = (hash ^ word) * 0x9E3779B97F4A7C15ull, hash ^= hash >> 29;
            return hash;
        }
    };
    std::unordered_map<std::array<std::uint32_t, 3>, std::int32_t, Hash> vertices;
    vertices.reserve(positions.size());
    std::vector<std::int32_t> vertex_of(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        std::array<std::uint32_t, 3> key;
        for (int axis = 0; axis < 3; ++axis)
            key[axis] = std::bit_cast<std::uint32_t>(positions[i][axis] + 0.0f);  // -0 is 0
        vertex_of[i] = vertices.try_emplace(key, static_cast<std::int32_t>(vertices.size())).first->second;
    }
    return vertex_of;
}

MeshPtr joined(const MeshFile& file, const std::vector<std::int32_t>& vertex_of, std::string name)
{
    auto mesh = std::make_shared<DetailedMesh>();
    mesh->name = std::move(name);
    std::vector<Vec3f> colours;
    std::vector<float> alphas;
    std::vector<std::size_t> first_corners;  // of each vertex
    for (std::size_t i = 0; i < file.positions.size(); ++i) {
        if (vertex_of[i] != static_cast<std::int32_t>(mesh->positions.size())) continue;  // not its first corner
        mesh->positions.push_back(file.positions[i]);
        first_corners.push_back(i);
        if (!file.colours.empty()) {
            colours.push_back(file.colours[i]);
            alphas.push_back(file.alphas[i]);
        }
    }
    std::vector<std::size_t> kept;  // indices of the remaining triangles
    for (std::size_t f = 0; f < file.triangles.size(); ++f) {
        const Mesh::Triangle& t = file.triangles[f];
        const Mesh::Triangle joined(vertex_of[t[0]], vertex_of[t[1]], vertex_of[t[2]]);
        // A face with merged corners is a line and its edges cancel, so removing it does not open the mesh.
        if (joined[0] == joined[1] || joined[1] == joined[2] || joined[2] == joined[0]) continue;
        mesh->triangles.push_back(joined);
        kept.push_back(f);
    }
    if (mesh->triangles.empty())
        throw Error(fmt::format("the mesh \"{}\" has {} vertices but no faces; a mesh needs at least one triangle",
                                mesh->name, mesh->positions.size()));

    if (std::any_of(alphas.begin(), alphas.end(), [](float alpha) { return alpha != 1.0f; }))
        mesh->values.emplace("Alpha", std::move(alphas));
    if (!colours.empty()) mesh->values.emplace("Cd", std::move(colours));
    for (const auto& [key, values] : file.values)
        std::visit(
            [&, &attribute = key]<class T>(const std::vector<T>& of_corners) {
                if (differ_at_vertices(of_corners, vertex_of, first_corners)) {
                    std::vector<T> of_faces;
                    for (const std::size_t f : kept)
                        for (int k = 0; k < 3; ++k)
                            of_faces.push_back(of_corners[static_cast<std::size_t>(file.triangles[f][k])]);
                    mesh->corner_values.emplace(attribute, std::move(of_faces));
                    return;
                }
                std::vector<T> of_vertices;
                for (const std::size_t corner : first_corners) of_vertices.push_back(of_corners[corner]);
                mesh->values.emplace(attribute, std::move(of_vertices));
            },
            values);
    for (const auto& [key, values] : file.face_values)
        std::visit(
            [&, &name_of = key](const auto& of_all) { mesh->face_values.emplace(name_of, selected(of_all, kept)); },
            values);
    for (const auto& [key, members] : file.face_groups) mesh->face_groups.emplace(key, selected(members, kept));
    mesh->skipped = file.skipped;
    return mesh;
}

MeshPtr read_mesh(const std::filesystem::path& path)
{
    const MeshFile file = read_mesh_file(path);
    return joined(file, join_by_position(file.positions), path.string());
}

}  // namespace rapid
