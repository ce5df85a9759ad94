// The audit of contacts: counts them, records them for the points, and sums their effect on energy.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/ejection.h"
#include "runtime/solver/collision/free_motion.h"
#include "runtime/solver/collision/stuck_points.h"
#include "runtime/solver/collision/touched_points.h"
#include "runtime/solver/figures.h"

namespace rapid {

class ContactAudit {
public:
    explicit ContactAudit(const CollisionBlock& block) : block_(block) {}

    // Adds an impact of a point of the block, faster than those of a resting point, which are due to rounding.
    void add(std::size_t i, int obstacle, const Impact& impact);
    void add_limited() { ++figures_.contact_limit; }
    void add_trapped(std::size_t points) { figures_.trapped += points; }
    // Are called at the end of a substep: for points that moved freely at first, and for points that shapes carry.
    void add_energy(const TouchedPoints& touched, const StuckPoints& stuck, const FreeMotion& motion);
    void add_carried(const StuckPoints& stuck, const FreeMotion& motion);

    // Under linear forces: the work of contacts in the motion of a point, J/kg, known when its substep is over; the
    // work of displacements, and of corrections after the substep from P and v.
    void begin_work();
    void add_work(std::size_t i, double by) { work_[i] += by; }
    void set_work(std::size_t i, double work) { work_[i] = work; }
    double work_now(std::size_t i) const { return work_[i]; }
    void count_work(const TouchedPoints& touched);
    void add_displacements(std::span<const Ejection::Displacement> displacements, const FreeMotion& motion);
    void add_corrections(std::span<const Vec3d> P, std::span<const Vec3d> v, const FreeMotion& motion);
    // Returns the work of contacts on each point since the block began, J/kg; empty without linear forces.
    std::span<const double> work() const { return all_work_; }

    // Starts a new block.
    void begin() { all_work_.clear(); }
    // Adds the work of displacements that led to P at the end of the frame.
    void add_final_corrections(std::span<const Vec3d> P, std::span<const Ejection::Displacement> displacements,
                               const FreeMotion& motion);

    const FrameFigures& figures() const { return figures_; }

private:
    const CollisionBlock& block_;
    FrameFigures figures_;
    std::vector<double> work_, all_work_;  // J/kg, by point of the block: in this substep or half of it, and in total
};

}  // namespace rapid
