// A shape whose surface is material that can be followed while it moves: a rigid body, or a mesh that deforms.
#pragma once

#include "runtime/shapes/shape.h"

namespace rapid {

// A point of a body. Of a rigid one (face -1) its place in the body's frame; of a mesh its place over a face: P = p0 +
// x (p1 - p0) + y (p2 - p0) + z n, which may be outside of the face.
struct MaterialPoint {
    static constexpr std::int32_t rigid = -1;

    std::int32_t face = rigid;
    Vec3d at = Vec3d::Zero();
};

class MovingBody : public Shape {
public:
    // The acceleration, m/s², of a point at P with velocity v (m/s) that moves uniformly in the frame of the body, or
    // of the face nearest to it: any other acceleration presses it to the surface, or draws it off. time: s since the
    // interval began.
    virtual Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const = 0;

    // The point of the body that is at P.
    virtual MaterialPoint material_at(const Vec3d& P, double time) const = 0;
    // Whether a point of this kind belongs to the body.
    virtual bool has(const MaterialPoint& point) const = 0;

    struct State {
        Vec3d P, v, a;
    };
    virtual State follow(const MaterialPoint& point, double time) const = 0;
};

}  // namespace rapid
