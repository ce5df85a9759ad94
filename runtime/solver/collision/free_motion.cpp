#include "runtime/solver/collision/free_motion.h"

namespace rapid {

void FreeMotion::begin(const Drift& drift)
{
    a_ = drift.a;
    damped_ = drift.damped;
    if (!is_damped()) return;
    const std::size_t size = block_.size();
    mean_a_.resize(size);
    path_v_.resize(size);
    path_a_.resize(size);
    for (std::size_t i = 0; i < size; ++i) {
        const double dt = block_.dt[i];
        mean_a_[i] = dt > 0 ? Vec3d((damped_[i].v - block_.v[i]) / dt) : damped_[i].G;
        path_v_[i] = damped_[i].path_v;
        path_a_[i] = damped_[i].path_a;
    }
    a_ = {mean_a_.data(), 1};
}

void FreeMotion::trace()
{
    if (!is_damped()) return paths_.begin(block_.P, block_.v, a_, block_.dt);
    paths_.begin(block_.P, path_v_, {path_a_.data(), 1}, block_.dt);
    for (std::size_t i = 0; i < block_.size(); ++i) paths_.end_with(i, paths_.P(i), damped_[i].v);
}

Path FreeMotion::path(std::size_t i, double radius) const
{
    const double dt = block_.dt[i], begin = block_.frame_time(i, dt);
    if (is_damped()) return {block_.P[i], path_v_[i], path_a_[i], dt, radius, begin};
    return {block_.P[i], block_.v[i], a_[i], dt, radius, begin};
}

// The velocity of a dragged point decreases from the first to the last value; in between, it is taken as linear in
// time.
Vec3d FreeMotion::velocity_after(std::size_t i, double s) const
{
    const double dt = block_.dt[i];
    if (!is_damped()) return block_.v[i] + s * a_[i];
    return dt > 0 ? Vec3d(block_.v[i] + s / dt * (damped_[i].v - block_.v[i])) : block_.v[i];
}

}  // namespace rapid
