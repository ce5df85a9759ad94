// A mesh with values at face corners and on faces, in addition to those at its vertices.
#pragma once

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

class DetailedMesh : public Mesh {
public:
    using Values = std::map<std::string, VertexValues>;

    // Attributes with several values per vertex, one for each face around it (texture coordinates at seams): shape
    // [triangles, 3].
    Values corner_values;
    Values face_values;                                            // shape [triangles]
    std::map<std::string, std::vector<std::uint8_t>> face_groups;  // 0 or 1, shape [triangles]
    std::vector<std::string> skipped;  // ignored contents of the file, for a warning: "the list "flags" of its faces"
};

using DetailedMeshPtr = std::shared_ptr<const DetailedMesh>;

// Returns null if the mesh only has values at its vertices.
inline DetailedMeshPtr detailed(const MeshPtr& mesh) { return std::dynamic_pointer_cast<const DetailedMesh>(mesh); }

}  // namespace rapid
