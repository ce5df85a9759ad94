#include "runtime/solver/collision/ejection.h"

namespace rapid {

void Ejection::eject(CollidingPoint& point, const Contact& contact, int obstacle, const Vec3d& path_v, const Vec3d& a)
{
    point.supports = 0;
    const Vec3d before = block_.P[point.i];
    if (++point.ejections > max_ejections || !move_out(point, contact, obstacle, path_v, a)) {
        lost_.push_back(point.i);
        point.left = 0;
    }
    displacements_.push_back({point.i, block_.P[point.i] - before});
    point.by_forces.from += displacements_.back().by;
}

// Returns false if there is no way out.
bool Ejection::move_out(const CollidingPoint& point, const Contact& contact, int obstacle, const Vec3d& path_v,
                        const Vec3d& a)
{
    Vec3d& P = block_.P[point.i];
    if (!contact.n.isZero()) {
        P += contact.depth * contact.n;
        return true;
    }
    if (contact.back != Contact::none) {
        P -= contact.back * (path_v - contact.vc);
        return true;
    }
    // The point has not moved in by itself, so it moves out against the acceleration on it, or upwards.
    const Obstacle& body = block_.obstacles[obstacle];
    const double pull = a.norm();
    const Vec3d down = pull > 0 ? Vec3d(a / pull) : Vec3d(-Vec3d::UnitY());
    const Path fall{
        P, contact.vc + down, Vec3d::Zero(), 0, block_.radius(body, point.i), block_.frame_time(point.i, point.left)};
    Contact above;
    body.shape->first_contact({&fall, 1}, {&above, 1});
    if (above.back == Contact::none) return false;
    P -= above.back * down;
    return true;
}

}  // namespace rapid
