// The attributes of vertices that a glTF file names by itself (glTF 2.0, 3.7.2.1: _NAME), which Assimp does not read.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

struct GltfAttributes {
    struct Primitive {
        std::size_t vertices = 0;
        std::map<std::string, Mesh::VertexValues> values;  // by what follows the _; each of shape [vertices]
    };
    std::vector<Primitive> primitives;  // of the file's meshes, in its order
    std::vector<std::string> left_out;  // attributes that are no numbers and no vectors of three
};

// Of a .gltf with its buffers, or a .glb. Error: a number that leads out of the file.
GltfAttributes read_gltf_attributes(const std::filesystem::path& path);

}  // namespace rapid
