// The audit of contacts: counts them, records them for the points, and sums their effect on energy.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/ejection.h"
#include "runtime/solver/collision/free_motion.h"
#include "runtime/solver/collision/stuck_points.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

// The energy that contacts add to points and remove from them, for the audit of a method (numerics.md, Collision).

// J, kinetic energy plus the potential energy of each substep's constant acceleration. A contact with a shape at rest
// adds none: any gain is the work of moving shapes, or the error of a method.
struct ContactEnergy {
    double added = 0, lost = 0;  // each summed over points and substeps

    void take(double change) { (change > 0 ? added : lost) += std::abs(change); }
    ContactEnergy& operator+=(const ContactEnergy& other)
    {
        added += other.added;
        lost += other.lost;
        return *this;
    }
    bool operator==(const ContactEnergy&) const = default;
};

struct ContactCounts {
    std::uint64_t contacts = 0;  // faster than those of a resting point, which are due to rounding
    std::uint64_t limited = 0;   // points that reached the limit of contacts in a step
    std::uint64_t trapped = 0;   // points inside a shape at the end of the frame, with no way out
    ContactEnergy energy;
};

class ContactAudit {
public:
    explicit ContactAudit(const CollisionBlock& block) : block_(block) {}

    // Adds an impact of a point of the block.
    void add(std::size_t i, int obstacle, const Impact& impact);
    void add_limited() { ++counts_.limited; }
    void add_trapped(std::size_t points) { counts_.trapped += points; }
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

    const ContactCounts& counts() const { return counts_; }

private:
    const CollisionBlock& block_;
    ContactCounts counts_;
    std::vector<double> work_, all_work_;  // J/kg, by point of the block: in this substep or half of it, and in total
};

}  // namespace rapid
