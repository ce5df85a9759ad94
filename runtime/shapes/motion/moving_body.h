// A shape whose surface is material that can be followed while it moves: a rigid body or a deforming mesh.
#pragma once

#include "runtime/shapes/shape.h"

namespace rapid {

// A point of a body. For a rigid body (face -1), its position in the body's frame. For a mesh, its position relative to
// a face, P = p0 + x (p1 - p0) + y (p2 - p0) + z n, which may lie outside the face.
struct MaterialPoint {
    static constexpr std::int32_t rigid = -1;

    std::int32_t face = rigid;
    Vec3d at = Vec3d::Zero();
};

class MovingBody : public Shape {
public:
    // Returns the acceleration, m/s², of a point at P with velocity v (m/s) that moves uniformly in the frame of the
    // body, or of its nearest face. Any other acceleration presses the point to the surface or pulls it off. time: s
    // since the beginning of the interval.
    virtual Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const = 0;

    // Returns the point of the body that is at P.
    virtual MaterialPoint material_at(const Vec3d& P, double time) const = 0;
    // Returns true if the point belongs to this body.
    virtual bool has(const MaterialPoint& point) const = 0;

    struct State {
        Vec3d P, v, a;
    };
    virtual State follow(const MaterialPoint& point, double time) const = 0;
};

}  // namespace rapid
