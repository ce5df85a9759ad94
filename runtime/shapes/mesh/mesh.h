// A triangle mesh: positions, faces, and the values at its vertices that its file has (Cd, any float).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "runtime/base/object.h"
#include "runtime/math/vec.h"

namespace rapid {

class Mesh : public Object {
public:
    using Triangle = Eigen::Matrix<std::int32_t, 3, 1>;
    using VertexValues = std::variant<std::vector<float>, std::vector<Vec3f>>;

    static constexpr std::string_view param_type = "mesh";
    std::string_view kind() const override { return "mesh"; }

    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;  // counter-clockwise seen from outside; polygons are split when a mesh is created
    std::map<std::string, VertexValues> values;
    std::string name;  // for messages: the file, or "sphere", "torus", ...

    Box3f bounds() const;
    double area() const;           // m²
    double signed_volume() const;  // m³; negative if the faces point inwards

    // Edges that keep the mesh from enclosing a volume: those without exactly two faces of opposite orientation.
    struct Openness {
        std::size_t boundary_edges = 0;      // one face
        std::size_t non_manifold_edges = 0;  // three or more faces, or two of the same orientation
        std::size_t odd_edges = 0;         // one, three, ... faces: a ray from outside may cross an odd number of faces
        std::size_t unbalanced_edges = 0;  // more faces one way than the other: winding numbers are not integers
        bool closed() const { return boundary_edges == 0 && non_manifold_edges == 0; }
    };
    Openness openness() const;
};

using MeshPtr = std::shared_ptr<const Mesh>;

// Reads OBJ, PLY, STL or glTF and merges coincident vertices (STL shares none). Throws Error if the file does not exist
// or cannot be parsed, has no triangles, or has a coordinate that is not finite.
MeshPtr read_mesh(const std::filesystem::path& path);

// Create built-in meshes, centred on `center`. Lengths are in metres and above 0; divisions are at least 3 (sphere,
// torus) or 1 (grid).
MeshPtr make_sphere(double radius, int divisions, const Vec3d& center);
MeshPtr make_box(const Vec3d& size, const Vec3d& center);
MeshPtr make_grid(double size_x, double size_z, int divisions, const Vec3d& center);  // in the plane y = center.y
MeshPtr make_torus(double radius, double tube, int divisions, const Vec3d& center);   // about the y axis
// Creates a mesh from faces that are lists of vertex indices, from 0. Splits them into fans. Throws Error if an index
// is out of range or a face has fewer than three corners.
MeshPtr make_mesh(std::vector<Vec3f> points, const std::vector<std::vector<std::int32_t>>& faces);

// Returns the mesh transformed by an affine map. Faces are flipped if the map mirrors.
MeshPtr transformed(const MeshPtr& mesh, const Eigen::Affine3d& map);

}  // namespace rapid
