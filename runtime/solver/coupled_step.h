// A step of points that constraints couple. The substep is the barrier: in each, all points move freely, block by
// block; then the constraints are projected (constraints/constraint.h).
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/block_step.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_forces.h"
#include "runtime/solver/constraints/projection.h"
#include "runtime/solver/constraints/sleep.h"
#include "runtime/solver/constraints/spin.h"
#include "runtime/solver/step_context.h"

namespace rapid {

class CoupledStep {
public:
    CoupledStep(StepContext& context, const Dynamics& dynamics);

    void run();

private:
    void read_points(std::size_t begin, std::size_t end);
    void begin_substeps();
    void begin_held();
    void begin_forces();
    void begin_spins();
    bool is_isolated(const Projection& projection) const;
    void interact(int kicks, double time);
    void advance_freely(std::size_t begin, std::size_t end);
    void begin_block(BlockStep& step, std::span<const std::uint32_t> indices);
    void take_point(const PointBlock& block, std::size_t k, bool is_carried);
    void add_drag(const PointBlock& block, std::size_t k, double contacts, EnergyChanges& changes) const;
    EnergyChanges changes(const Projection& projection);
    bool skips(std::size_t i);
    void store(std::size_t begin, std::size_t end);
    void add_displacements(const Projection& projection);
    Mobility mobility_of(const PointBlock& block, std::size_t k) const;
    FreePath free_path(const PointBlock& block, std::size_t k) const;
    Vec3d acceleration_of(const PointBlock& block, std::size_t k, bool asleep) const;
    bool holds_still(std::size_t i) const;
    double inverse_mass(std::size_t i) const;

    StepContext& context_;
    const Dynamics& dynamics_;
    // By point.
    std::vector<ProjectedPoint> at_;
    std::vector<Vec3d> v_, start_;
    std::vector<double> inverse_mass_;  // 1/kg
    std::vector<Mobility> mobility_;    // empty if no force has a linear part
    std::vector<SurfaceSpring> surface_springs_;
    // By point. prescribed_: a constraint prescribes its motion in the frame. held_: it is prescribed or asleep, and
    // has no free motion.
    std::vector<std::uint8_t> prescribed_, held_;
    std::vector<std::uint8_t> carried_;  // by point: carried by a shape in the substep
    std::vector<Vec3d> carried_v_;       // Substep::carried_v
    std::vector<Vec3d> born_;            // Substep::born
    std::vector<double> energy_;         // Substep::energy
    std::vector<Vec3d> displacement_;    // Substep::displacement; empty if no constraint needs it
    std::vector<FreePath> paths_;        // empty if nothing bounces

    std::vector<Vec3d> reaction_;  // Substep::reaction

    Substep now_;
    std::optional<ContactForces> forces_;  // set if they are recorded
    std::optional<SpinState> spin_;        // set if points turn
    // Obstacles without friction on turning points, for their free motion; the projection applies that friction, which
    // also turns them.
    std::vector<Obstacle> smooth_;
    std::vector<std::vector<float>> smooth_friction_;
    std::optional<Sleep> sleep_;   // set if points may sleep
    bool skips_sleepers_ = false;  // only uniform forces act, so sleeping points are skipped in the blocks
    std::mutex mutex_;
    std::map<std::size_t, Vec3d> displaced_;  // displacements by store() of points that were inside shapes
    std::vector<std::pair<std::size_t, EnergyChanges>> free_changes_;  // in free motion, keyed by a point of the chunk
};

}  // namespace rapid
