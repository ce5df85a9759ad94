// Winding numbers in a mesh, by the faces that a ray along +x crosses.
//
// A vertex or an edge on the ray belongs to exactly one of the faces around it, so that none is counted twice or
// missed, whatever the origin.
#pragma once

#include <vector>

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

class RayCrossings {
public:
    explicit RayCrossings(MeshPtr mesh);

    struct Count {
        int faces = 0;     // crossed: odd inside, if each edge of the mesh has an even number of faces
        int windings = 0;  // the winding number: 0 outside, if each edge is balanced
    };
    Count from(const Vec3d& P) const;

    // Of a whole line along x: the faces that it crosses, and by how much each changes the winding number towards lower
    // x, in ascending order of x.
    struct Crossing {
        double x;
        int turn;  // 1 out of a face, -1 into it
        std::int32_t triangle;
    };
    void along_x(double y, double z, std::vector<Crossing>& crossings) const;

private:
    Vec3d corner(std::int32_t triangle, int k) const
    {
        return mesh_->positions[mesh_->triangles[triangle][k]].cast<double>();
    }
    int bin_at(double place, int axis) const;
    template <class F>
    void for_each_bin(const F& f) const;

    MeshPtr mesh_;
    Box3d bounds_;
    int bins_;  // along y, and along z
    Vec3d per_metre_;
    std::vector<std::size_t> first_;       // shape [bins y, bins z, + 1]: where a bin's triangles begin
    std::vector<std::int32_t> triangles_;  // by bin
};

}  // namespace rapid
