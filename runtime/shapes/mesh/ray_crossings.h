// Winding numbers in a mesh, from the faces that a ray along +x crosses.
//
// A vertex or edge on the ray belongs to exactly one of the adjacent faces, so that none is counted twice or missed,
// whatever the origin.
#pragma once

#include <vector>

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

class RayCrossings {
public:
    explicit RayCrossings(MeshPtr mesh);

    struct Count {
        int faces = 0;     // faces crossed; odd inside if every edge has an even number of faces
        int windings = 0;  // winding number; 0 outside if every edge is balanced
    };
    Count from(const Vec3d& P) const;

    // Finds the crossings of a whole line along x, in ascending order of x. Each has the change of the winding number
    // towards lower x.
    struct Crossing {
        double x;
        int turn;  // 1 when leaving through the face in the direction of +x, -1 when entering
        std::int32_t triangle;
    };
    void along_x(double y, double z, std::vector<Crossing>& crossings) const;

private:
    Vec3d corner(std::int32_t triangle, int k) const
    {
        return mesh_->positions[mesh_->triangles[triangle][k]].cast<double>();
    }
    int bin_at(double coordinate, int axis) const;
    template <class F>
    void for_each_bin(const F& f) const;

    MeshPtr mesh_;
    Box3d bounds_;
    int bins_;  // along each of y and z
    Vec3d per_metre_;
    std::vector<std::size_t> first_;       // shape [bins y, bins z, + 1]: first triangle of each bin
    std::vector<std::int32_t> triangles_;  // sorted by bin
};

}  // namespace rapid
