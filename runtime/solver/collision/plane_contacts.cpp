#include "runtime/solver/collision/plane_contacts.h"

#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/plane_rest.h"
#include "runtime/solver/collision/response.h"

namespace rapid {

void PlaneContacts::finish(std::size_t o)
{
    if (batch_.size() == 0) return;
    batch_.solve(*block_.obstacles[o].plane);
    for (std::size_t other = 0; other < block_.obstacles.size(); ++other)
        if (other != o && block_.obstacles[other].is_continuous())
            batch_.leave_out_near(block_.obstacles[other].bounds, broad_phase_.largest_radius(other));
    for (std::size_t j = 0; j < batch_.size(); ++j) take(j, o);
    batch_.clear();
}

// Stores the result of one point of the batch.
void PlaneContacts::take(std::size_t j, std::size_t o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    const std::uint32_t i = batch_.point(j);
    const PlaneBatch::Outcome outcome = batch_.outcome(j);
    const bool responds = obstacle.response == Response::Bounce || obstacle.response == Response::Slide;
    if (outcome == PlaneBatch::Undecided || (outcome != PlaneBatch::Misses && !responds)) {
        touched_.set_only_plane(i, -1);
        contacts_.add(i, motion_.path(i, block_.radius(obstacle, i)));
        return;
    }
    const int plane = static_cast<int>(o);
    touched_.set_only_plane(i, corrects_positions_ ? -1 : plane);
    if (outcome == PlaneBatch::Misses) return;
    motion_.paths().end_with(i, batch_.end(j), batch_.velocity(j));
    touched_.add(i);
    const Vec3d n = obstacle.plane->n;
    if (outcome == PlaneBatch::Bounces)
        audit_.add(i, plane,
                   {batch_.contact(j), n, Vec3d::Zero(), batch_.approach(j),
                    motion_.velocity_after(i, block_.dt[i] - batch_.left(j)), batch_.change(j),
                    block_.time(i, batch_.left(j))});
    else
        touched_.set_surface(i, {plane, n});
}

bool PlaneContacts::slides_on_plane(std::size_t i)
{
    const Contact& contact = contacts_.contact(i);
    if (!contact.flat || contact.time > 0 || contact.depth > 0) return false;
    const int o = contacts_.obstacle(i);
    const Obstacle& obstacle = block_.obstacles[o];
    const Vec3d &P = block_.P[i], &v = block_.v[i];
    if (motion_.longest_parabola(i, block_.dt[i]) < block_.dt[i]) return false;
    if (obstacle.response == Response::Stick || obstacle.response == Response::Die || obstacle.clings()) return false;
    if (!obstacle.acceleration_at(P, v, block_.frame_time(i, block_.dt[i])).isZero(0)) return false;
    const double g = -motion_.acceleration(i).dot(contact.n), vn = (v - contact.vc).dot(contact.n);
    if (!stays_on_plane(vn, g, obstacle.contact_tolerance(P, block_.radius(obstacle, i)), block_.dt[i])) return false;

    const Support on{o, contact.n, contact.vc, 0, obstacle.friction[block_.indices[i]], true, obstacle.feature};
    if (!slide_on_plane(i, on)) return false;
    touched_.set_surface(i, {o, on.n});
    return true;
}

bool PlaneContacts::slide_on_plane(std::size_t i, const Support& on)
{
    Vec3d &P = block_.P[i], &v = block_.v[i];
    const Vec3d& a = motion_.acceleration(i);
    const double dt = block_.dt[i];
    const Vec3d along = tangential_to(on, contact_response(v, on.vc, on.n, 0, on.friction));
    const Slide slide = slide_on(on, along, a, dt, min_turning_piece * dt);
    if (slide.kind == Slide::Leaves) return false;
    if (slide.kind == Slide::Sticks) {
        v = on.vc;
        P += dt * on.vc;
        return true;
    }
    const double left = dt - slide.duration;
    if (left > 0 && !(slide.stops && slide_on(on, on.vc, a, left, 0).kind == Slide::Sticks)) return false;
    const Path path{P, along, slide.a, slide.duration, 0};
    if (may_meet_another(i, path, on.collider)) return false;
    P = path.at(path.duration) + left * on.vc;
    v = slide.stops ? on.vc : Vec3d(path.v + path.duration * path.a);
    return true;
}

bool PlaneContacts::may_meet_another(std::size_t i, const Path& path, int obstacle) const
{
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o)
        if (static_cast<int>(o) != obstacle && block_.may_reach_obstacle(i, path, o)) return true;
    return false;
}

}  // namespace rapid
