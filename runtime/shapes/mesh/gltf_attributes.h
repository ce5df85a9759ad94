// The custom vertex attributes of a glTF file (glTF 2.0, 3.7.2.1: _NAME), which Assimp does not read.
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
        std::map<std::string, Mesh::VertexValues> values;  // by NAME, without the _; each of shape [vertices]
    };
    std::vector<Primitive> primitives;  // of all meshes, in file order
    std::vector<std::string> skipped;   // attributes that are neither numbers nor vectors of three
};

// Reads a .gltf with its buffers, or a .glb. Throws Error if an index or offset points outside the file.
GltfAttributes read_gltf_attributes(const std::filesystem::path& path);

}  // namespace rapid
