#include "runtime/solver/collision/contact_rounds.h"

#include "runtime/shapes/first_contact.h"

namespace rapid {

void ContactRounds::start(std::uint32_t i)
{
    const std::size_t slot = started_++;
    if (slot == points_.size()) points_.emplace_back();
    CollidingPoint& point = points_[slot];
    point.begin(i, block_.dt[i]);
    const double s = contacts_.contact(i).time;
    const Path path = motion_.path(i);
    const ContactResolver::Arrival arrival{path.at(s), motion_.velocity_after(i, s), motion_.acceleration(i), path.v};
    point.by_forces.begin(arrival.P, arrival.v);
    resolver_.resolve(point, arrival, contacts_.contact(i), contacts_.obstacle(i));
    if (goes_on(point)) going_.push_back(static_cast<std::uint32_t>(slot));
}

void ContactRounds::resume(std::uint32_t i, double left, const std::optional<Support>& on)
{
    const std::size_t slot = started_++;
    if (slot == points_.size()) points_.emplace_back();
    CollidingPoint& point = points_[slot];
    point.begin(i, block_.dt[i]);
    point.left = left;
    if (on) point.on[0] = *on, point.supports = 1;
    point.by_forces.begin(block_.P[i], block_.v[i]);
    if (goes_on(point)) going_.push_back(static_cast<std::uint32_t>(slot));
}

void ContactRounds::run()
{
    while (!going_.empty()) {
        curved_.find_ends(points_, going_);
        find_contacts();
        going_on_.clear();
        for (const std::uint32_t slot : going_) {
            CollidingPoint& point = points_[slot];
            if (point.kind != CollidingPoint::Waits) {
                if (contacts_.has(point.i))
                    resolver_.resolve_on_path(point, contacts_.contact(point.i), contacts_.obstacle(point.i));
                else
                    planner_.finish_path(point);
            }
            if (goes_on(point)) going_on_.push_back(slot);
        }
        going_.swap(going_on_);
    }
    started_ = 0;
}

// Plans the next path of a point, and follows it if no shape has to be queried. Returns false if its substep is over.
bool ContactRounds::goes_on(CollidingPoint& point)
{
    while (planner_.plan(point)) {
        if (point.kind == CollidingPoint::Curved || may_meet_shape(point)) return true;
        planner_.finish_path(point);
    }
    const auto surface = [&](int k) {
        return k < point.supports ? TouchedPoints::Surface{point.on[k].collider, point.on[k].n}
                                  : TouchedPoints::Surface{};
    };
    touched_.set_surfaces(point.i, {surface(0), surface(1)});
    if (motion_.is_damped()) {
        point.by_forces.advance(block_.P[point.i], motion_.acceleration(point.i));
        audit_.add_work(point.i, point.by_forces.of_contacts(block_.v[point.i]));
    }
    return false;
}

bool ContactRounds::may_meet_shape(const CollidingPoint& point) const
{
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o)
        if (may_meet(point, o)) return true;
    return false;
}

// Returns true if the path may lead to a shape that the point is not on.
bool ContactRounds::may_meet(const CollidingPoint& point, std::size_t obstacle) const
{
    return !point.rests_on(static_cast<int>(obstacle)) && block_.may_reach_obstacle(point.i, point.path, obstacle);
}

// Searches all shapes, because a bounce may lead to any of them.
void ContactRounds::find_contacts()
{
    for (const std::uint32_t slot : going_) contacts_.clear(points_[slot].i);
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
        for (const std::uint32_t slot : going_) {
            const CollidingPoint& point = points_[slot];
            if (point.kind == CollidingPoint::Waits || !may_meet(point, o)) continue;
            Path path = point.path;
            path.radius = block_.radius(block_.obstacles[o], point.i);
            path.begin = block_.frame_time(point.i, point.left);
            contacts_.add(point.i, path);
        }
        contacts_.ask(o);
    }
}

}  // namespace rapid
