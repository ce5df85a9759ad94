#include "runtime/solver/collision/response.h"

namespace rapid {

// v+ = vc + vt max(0, 1 - μ (1 + ε) |vn| / |vt|) - ε vn,   vn = ((v - vc)·n) n,   vt = (v - vc) - vn
//
// The paper prints (4) with v instead of v - vc, which holds only for shapes at rest. The impulse along n is m (1 + ε)
// |vn|, so Coulomb friction takes at most μ times that from the tangent; the max with 0 is static friction.
Vec3d contact_response(const Vec3d& v, const Vec3d& vc, const Vec3d& n, double bounce, double friction)
{
    const Vec3d relative = v - vc;
    const double approach = -relative.dot(n);  // |vn| of a closing pair
    if (approach <= 0) return v;

    const Vec3d vt = relative + approach * n;
    const double slide = vt.norm();
    const double lost = friction * (1 + bounce) * approach;
    const double kept = slide > lost ? 1 - lost / slide : 0;
    return vc + kept * vt + bounce * approach * n;
}

}  // namespace rapid
