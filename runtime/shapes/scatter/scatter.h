// Where particles are born on or in a shape.
//
// The position of a birth depends on the random key and the birth's number alone, so births can be placed in parallel
// and in any order.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "runtime/random.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/shape.h"

namespace rapid {

struct Birthplace {
    Vec3f P = Vec3f::Zero();    // m
    Vec3f N = Vec3f::Zero();    // unit normal, out of the surface; zero in a volume
    std::int32_t element = -1;  // the triangle of a mesh; -1 where there is none
    float b1 = 0, b2 = 0;       // barycentric weights of the triangle's second and third corner
};

class Scatter {
public:
    virtual ~Scatter() = default;

    // Birth number first + i goes to out[i]. Of the key's numbers for that birth it takes the uses 0 to 15, and those
    // whose low 32 bits are 0 to 15: rejection sampling counts its trials in the high bits.
    virtual void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const = 0;
};

using ScatterPtr = std::shared_ptr<const Scatter>;

// Uniform by area; N is the face's normal. Error: a mesh of no area.
ScatterPtr scatter_on_surface(const MeshPtr& mesh);
// Uniform by volume, over the points around which the faces wind. Error: a mesh with edges of an odd number of faces,
// or without volume (with the numbers).
ScatterPtr scatter_in_volume(const MeshPtr& mesh);
// The same for a level set or an analytic shape, which gives its own (Shape::surface_scatter, volume_scatter). Error: a
// plane, which has no finite surface or volume.
ScatterPtr scatter_on_surface(const ShapePtr& shape);
ScatterPtr scatter_in_volume(const ShapePtr& shape);

}  // namespace rapid
