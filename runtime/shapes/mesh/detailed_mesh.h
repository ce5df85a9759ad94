// A mesh with what its file says of the corners of its faces, and of its faces, besides the values at its vertices.
#pragma once

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

class DetailedMesh : public Mesh {
public:
    using Values = std::map<std::string, VertexValues>;

    // Of vertices that have several, one for each face around them (texture coordinates at seams): shape [triangles,
    // 3].
    Values corner_values;
    Values face_values;                                            // shape [triangles]
    std::map<std::string, std::vector<std::uint8_t>> face_groups;  // 0 or 1, shape [triangles]
    std::vector<std::string> left_out;  // what the file has besides, for a warning: "the list "flags" of its faces"
};

using DetailedMeshPtr = std::shared_ptr<const DetailedMesh>;

// Null for a mesh that has no more than values at its vertices.
inline DetailedMeshPtr detailed(const MeshPtr& mesh) { return std::dynamic_pointer_cast<const DetailedMesh>(mesh); }

}  // namespace rapid
