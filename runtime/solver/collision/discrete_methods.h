// The paper's methods, `backtrack` (§4.2) and `project` (§4.1): points inside a shape at the end of a substep are
// moved out of it (numerics.md, Collision).
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/distance_query.h"
#include "runtime/solver/collision/free_motion.h"
#include "runtime/solver/collision/stuck_points.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

class DiscreteMethods {
public:
    DiscreteMethods(const CollisionBlock& block, const FreeMotion& motion, StuckPoints& stuck, TouchedPoints& touched,
                    ContactAudit& audit)
        : block_(block), motion_(motion), stuck_(stuck), touched_(touched), audit_(audit)
    {
    }

    // Starts a new block.
    void begin();
    // Returns true if an obstacle uses one of the methods.
    bool is_used() const { return is_used_; }

    // Is called before a substep.
    void begin_substep() { initial_P_.assign(block_.P.begin(), block_.P.end()); }
    // Is called at its end.
    void correct();

    // Returns a bound, m, on the position error since begin() due to contacts found at the end of a substep instead of
    // on the path.
    double position_error(std::size_t i) const { return position_error_[i]; }

private:
    void ask_about(const Obstacle& obstacle);
    void correct(int obstacle);
    bool move_out(std::size_t j, int obstacle);
    void backtrack(std::size_t i, const Obstacle& obstacle, const Vec3d& vc, double time, const Vec3d& n, double depth);
    void lift(const Obstacle& obstacle);

    const CollisionBlock& block_;
    const FreeMotion& motion_;
    StuckPoints& stuck_;
    TouchedPoints& touched_;
    ContactAudit& audit_;
    bool is_used_ = false;
    std::vector<Vec3d> initial_P_;        // at the beginning of the sub-step
    std::vector<double> position_error_;  // m
    DistanceQuery query_;
};

}  // namespace rapid
