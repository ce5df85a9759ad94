// The contents of a glTF 2.0 file that its meshes depend on: nodes, meshes, skins, morph targets and animations.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "runtime/shapes/mesh/mesh_file.h"

namespace rapid {

struct GltfPrimitive {
    std::vector<Vec3f> positions, normals;             // normals may be empty, as all that follows
    std::vector<Vec3f> colours;                        // COLOR_0
    std::vector<float> alphas;                         // 1 if COLOR_0 has three components
    std::map<std::string, Mesh::VertexValues> values;  // uv, uv2, ... and each _NAME as NAME
    std::vector<Mesh::Triangle> triangles;
    struct Target {  // what a morph target with weight 1 adds
        std::vector<Vec3f> positions, normals;
    };
    std::vector<Target> targets;
    std::vector<std::array<std::uint32_t, 4>> joints;  // JOINTS_0 and weights; four more per further set
    std::vector<std::array<float, 4>> weights;
    std::string material;
};

struct GltfMesh {
    std::string name;
    std::vector<GltfPrimitive> primitives;
    std::vector<float> weights;  // of the morph targets
};

// The transform of a node relative to its parent.
struct GltfTransform {
    Vec3d translation = Vec3d::Zero(), scale = Vec3d::Ones();
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    std::optional<Eigen::Affine3d> matrix;  // instead of these

    Eigen::Affine3d map() const;
};

struct GltfNode {
    std::string name;
    GltfTransform transform;
    std::optional<std::size_t> parent, mesh, skin;
    std::vector<float> weights;              // of the morph targets; empty: those of the mesh
    std::vector<Eigen::Affine3d> instances;  // EXT_mesh_gpu_instancing; empty: the mesh is there once
};

struct GltfSkin {
    std::vector<std::size_t> joints;             // nodes
    std::vector<Eigen::Affine3d> inverse_binds;  // shape [joints]
};

// Key frames of a property of a node.
struct GltfChannel {
    enum Path { Translation, Rotation, Scale, Weights };
    enum Interpolation { Step, Linear, Cubic };
    std::size_t node = 0;
    Path path = Translation;
    Interpolation interpolation = Linear;
    std::vector<float> times;   // s, not decreasing
    std::vector<float> values;  // shape [times, numbers], or [times, 3, numbers] of a cubic spline: with its tangents
    std::size_t numbers = 3;    // of one value
};

struct GltfAnimation {
    std::string name;
    std::vector<GltfChannel> channels;
};

struct GltfFile {
    std::vector<GltfMesh> meshes;
    std::vector<GltfNode> nodes;
    std::vector<std::size_t> order;  // all nodes, each after its parent
    std::vector<std::size_t> shown;  // those of the scene
    std::vector<GltfSkin> skins;
    std::vector<GltfAnimation> animations;
    std::vector<std::string> skipped;
};

// Returns the mesh of the scene, at a time of an animation in seconds, or at rest without one. Skins and morph targets
// deform it. The corners and triangles are the same at all times.
MeshFile posed(const GltfFile& file, const GltfAnimation* animation = nullptr, double time = 0);

// Returns the vertex of each corner of posed(). Corners share a vertex if all that moves them is the same: their place,
// node and instance, morph targets and joints. These coincide in every pose.
std::vector<std::int32_t> join_moved_alike(const GltfFile& file);

// Reads a .gltf with its buffers, or a .glb. Throws Error if it is not glTF 2.0, requires an extension that can't be
// read, or if an index or offset points outside the file.
GltfFile read_gltf(const std::filesystem::path& path);

}  // namespace rapid
