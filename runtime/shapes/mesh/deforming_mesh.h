// A mesh that changes with time, with the same vertices and faces throughout: the files of a sequence, or an animation.
#pragma once

#include <cstdint>
#include <memory>

#include "runtime/base/frame.h"
#include "runtime/base/object.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

class DeformingMesh {
public:
    virtual ~DeformingMesh() = default;

    virtual const MeshPtr& rest() const = 0;
    // Return the range of frames in which the mesh may change.
    virtual double begins() const = 0;
    virtual double ends() const = 0;
    // Returns true if the mesh is given by time, so that that of a frame depends on the clock.
    virtual bool depends_on_clock() const = 0;
    // Returns true if there is a mesh at this frame.
    virtual bool has(std::int64_t frame) const = 0;
    // Returns the mesh at a step of the clock. Thread-safe.
    virtual MeshPtr at(const FrameClock& clock, std::int64_t step) const = 0;
};

using DeformingMeshPtr = std::shared_ptr<const DeformingMesh>;

}  // namespace rapid
