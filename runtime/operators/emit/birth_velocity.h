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

// What it is made from outlives it.
class BirthVelocity {
public:
    // spread: rad.
    BirthVelocity(const Vec3d& velocity, const Interval& speed, double spread, double inherit,
                  const BirthSource& source);

    // Whether it needs random numbers.
    bool is_random() const { return is_random_; }
    // Whether it needs normals that follow a moving source.
    bool needs_normals() const { return !is_zero(speed_); }
    // Whether all newborn have the same.
    bool is_common() const { return is_common_; }
    Vec3f common() const { return (velocity_ + inherited_).cast<float>(); }

    // source_motion: the velocities of the birthplaces on a moving source, read where it moves. Spans have shape [n].
    // speed_draws: by speed_use, read where speed is random.
    void find(std::span<const Birthplace> places, std::span<const Draws> draws, std::span<const Draws> speed_draws,
              std::span<const Vec3d> source_motion, std::span<Vec3f> v) const;

private:
    const Vec3d velocity_;
    const Interval speed_;
    const double inherit_;
    const BirthSource& source_;
    const Cone cone_;
    bool is_random_, is_common_;
    bool source_v_differs_;  // its points differ in what is inherited of their v
    Vec3d inherited_;        // from the v of the source, where they do not
};

}  // namespace rapid
