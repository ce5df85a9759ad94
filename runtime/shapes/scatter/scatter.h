// Birth positions on and in shapes.
//
// A position depends only on the random key and the number of the birth, so births can be placed in parallel and in any
// order.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "runtime/math/random.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/shape.h"

namespace rapid {

struct Birthplace {
    Vec3f P = Vec3f::Zero();    // m
    Vec3f N = Vec3f::Zero();    // unit normal, out of the surface; zero in a volume
    std::int32_t element = -1;  // triangle of a mesh; -1 if there is none
    float b1 = 0, b2 = 0;       // barycentric weights of the triangle's second and third corner
};

class Scatter {
public:
    virtual ~Scatter() = default;

    // Writes birth number first + i to out[i]. For each birth it uses the random numbers 0 to 15 of the key, and those
    // whose low 32 bits are 0 to 15: rejection sampling counts its trials in the high bits.
    virtual void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const = 0;
};

using ScatterPtr = std::shared_ptr<const Scatter>;

// Samples uniformly by area; N is the face normal. areas: of the faces, m², in place of those of the mesh; may be
// empty. Throws Error if the mesh has no area.
ScatterPtr scatter_on_surface(const MeshPtr& mesh, std::span<const double> areas = {});
// Samples uniformly by volume, over the points with a nonzero winding number. Throws Error if the mesh has edges with
// an odd number of faces, or no volume (with the numbers).
ScatterPtr scatter_in_volume(const MeshPtr& mesh);
// Do the same for a level set or an analytic shape (Shape::surface_scatter, volume_scatter). Throw Error for a plane,
// which has no finite surface or volume.
ScatterPtr scatter_on_surface(const ShapePtr& shape);
ScatterPtr scatter_in_volume(const ShapePtr& shape);

}  // namespace rapid
