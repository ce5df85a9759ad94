// The velocities of newborn points, m/s.
//
//   v = C(velocity + speed N) + inherit v_source
//
// C turns a vector uniformly in a cone of the half angle `spread`; N is the normal at the birthplace. v_source is the
// velocity of the birthplace on a moving source, plus the source's own attribute v.
#pragma once

#include <span>

#include "runtime/operators/births/draws.h"
#include "runtime/operators/births/newborn.h"
#include "runtime/operators/emit/birth_source.h"

namespace rapid {

// Computes birth velocities. The constructor's arguments must outlive it.
class BirthVelocity {
public:
    // spread: rad.
    BirthVelocity(const Vec3d& velocity, const Interval& speed, double spread, double inherit,
                  const BirthSource& source);

    // Returns true if it needs random numbers.
    bool is_random() const { return is_random_; }
    // Returns true if it needs normals that follow a moving source.
    bool needs_normals() const { return !is_zero(speed_); }
    // Returns true if all newborn points have the same velocity.
    bool is_common() const { return is_common_; }
    Vec3f common() const { return (velocity_ + inherited_).cast<float>(); }

    // source_motion: velocities of the birthplaces, read if the source moves. Spans have shape [n]. speed_draws: by
    // speed_use, read if speed is random.
    void find(std::span<const Birthplace> birthplaces, std::span<const Draws> draws, std::span<const Draws> speed_draws,
              std::span<const Vec3d> source_motion, std::span<Vec3f> v) const;

private:
    const Vec3d velocity_;
    const Interval speed_;
    const double inherit_;
    const BirthSource& source_;
    const Cone cone_;
    bool is_random_, is_common_;
    bool source_v_differs_;  // source points differ in the inherited part of their v
    Vec3d inherited_;        // inherited part of the source's v if it is uniform
};

}  // namespace rapid
