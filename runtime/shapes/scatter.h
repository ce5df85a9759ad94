// Where particles are born on or in a shape.
//
// The place of a birth depends on the random key and the birth's number alone, so births can be placed in parallel and
// in any order.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "runtime/random.h"
#include "runtime/shapes/mesh.h"
#include "runtime/shapes/shape.h"

namespace rapid {

struct Birthplace {
    Vec3f P, N;                 // place (m) and unit normal, out of the surface; in a volume N is zero
    std::int32_t element = -1;  // the triangle of a mesh; -1 where there is none
    float b1 = 0, b2 = 0;       // barycentric weights of the triangle's second and third corner
};

class Scatter {
public:
    virtual ~Scatter() = default;

    // Birth number first + i goes to out[i]. Uses the uses 0 to 15 of the key's numbers for that birth.
    virtual void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const = 0;
};

using ScatterPtr = std::shared_ptr<const Scatter>;

// Uniform by area; N is the face's normal. Error: a mesh of no area.
ScatterPtr scatter_on_surface(const MeshPtr& mesh);
// Uniform by volume: points that a ray leaves through an odd number of faces. Error: a mesh that is not closed, or of
// no volume (with the counts).
ScatterPtr scatter_in_volume(const MeshPtr& mesh);
// The same of a level set or an analytic shape. Error: a plane, which has no finite surface or volume; an empty level
// set.
ScatterPtr scatter_on_surface(const ShapePtr& shape);
ScatterPtr scatter_in_volume(const ShapePtr& shape);

}  // namespace rapid
