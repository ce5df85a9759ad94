// Contacts between points: spheres that keep each other out, with friction and restitution (paper §5.1; Macklin et al.
// 2014).
//
//   C = |P_i - P_j| - (r_i + r_j) >= 0
//
// Gauss-Seidel begins with the impulses of the sub-step before, normal and tangential, so that sweeps have to find
// changes only. A pile at rest is then solved before it is iterated, by one sweep a sub-step, however high it is;
// without warm starting it would sink by 2 N g dt².
//
// An overlap that was there at the sub-step's beginning is not to be made deeper; it is recovered without giving speed.
// So points that are born in one another part, and do not fly.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/carried_impulses.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/contact_sleep.h"
#include "runtime/solver/constraints/heavy_contacts.h"
#include "runtime/solver/constraints/mass_scaling.h"
#include "runtime/solver/constraints/neighbour_list.h"
#include "runtime/solver/constraints/pair_blocks.h"
#include "runtime/solver/constraints/pair_impulses.h"
#include "runtime/solver/constraints/stray_pairs.h"

namespace rapid {

class Contacts : public Coupling, public CarriedImpulses {
public:
    // Before a frame; impulses are kept by the ids of points. Error: see ContactMaterial.
    void follow(const PointSet& points, const ContactOptions& options, const std::string& group);

    void join(Sleep* sleep) override;
    bool bounces() const override { return material_.bounces; }
    const ContactMaterial* turns() const override { return material_.turns() ? &material_ : nullptr; }
    bool only_dissipates() const override { return !material_.turns(); }  // but for mass scaling, whose gain is told
    bool keeps_momentum() const override { return !scaling_.is_set(); }
    std::span<const float> recorded() const override;
    void link(EnergyIslands& islands) const override;
    void detect(Substep& step) override;
    bool solve_impacts(Substep& step, std::uint32_t sweep) override;
    void follow_rods(std::span<const std::uint32_t> islands) override { rods_ = islands; }
    void warm_start(Substep& step) override;
    void project(Substep& step) override;
    void solve_velocities(Substep& step) override;
    void add_forces(const Substep& step) override;
    void correct_penetration(Substep& step) override;
    Residual close(Substep& step) override;

    // All that the search of the last frame has found, as the next may do without one.
    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(ids_, material_, grids_, list_, blocks_, impulses_, reach_, list_is_stale_, backwards_, per_dt_);
        if constexpr (Archive::is_loading::value) {
            StateReader::expect(is_consistent());
            packs_.resize(blocks_.size());
        }
    }

private:
    // Of a snapshot: whether all indices are of what is there.
    bool is_consistent() const;
    void renumber(const Column<std::int64_t>& ids, std::span<const std::uint32_t> index);
    void search(const Substep& step);
    void follow_strays(const Substep& step);
    void note_hits(std::size_t from);
    void measure_reaches(std::size_t from);
    void update_contacts(Substep& step);
    void find_contacts(const Substep& step);
    bool sweep_impacts(Substep& step, std::uint32_t number, std::uint32_t since);
    std::size_t find_near(std::size_t block, const Substep& step, std::vector<std::uint32_t>& near) const;
    bool may_touch(std::uint32_t pair, const Substep& step) const;
    void begin(ContactPack& pack, const Substep& step) const;
    void limit_carried(ContactPack& pack, const Substep& step) const;
    void store(const ContactPack& pack);
    static void add_pack_forces(const ContactPack& pack, const Substep& step);
    template <class F>
    void sweep(const F& f);
    template <class T, class F>
    void in_turn(std::vector<T>& list, const F& f) const;
    template <class Weights, class Recovery>
    Doubles solve_pack(ContactPack& pack, Substep& step, const Weights& weights, const Recovery* recovery,
                       double impact_speed);
    Doubles allowed_overlaps(const ContactPack& pack) const;

    std::vector<std::int64_t> ids_;
    ContactMaterial material_;
    bool records_ = false;
    RadiusGrids grids_{{nullptr, 0}, 0, 0, 1};
    NeighbourList list_;
    StrayPairs strays_;
    PairBlocks blocks_;
    PairImpulses impulses_, previous_;  // in the order of the blocks; and of the list before
    // Of each pair, whether an impact has hit it in this sub-step; and those of the lists before that it has hit.
    std::vector<std::uint8_t> hit_;
    std::vector<ContactPair> hit_before_;
    std::vector<float> reach_;  // m, of each pair; padded for whole packs
    ContactPacks packs_;
    std::vector<std::vector<const ContactPack*>> deep_;  // by block, those with an overlap that a sweep leaves deep
    MassScaling scaling_;
    HeavyContacts heavy_;
    ContactSleep sleep_;

    bool begins_frame_ = true, list_is_stale_ = true, backwards_ = false;
    bool impacts_moved_ = false;            // points, since their contacts were found
    double per_dt_ = 0;                     // 1/s, of the last sub-step
    double search_seconds_ = 0;             // in this frame
    std::vector<Vec3d> before_;             // positions before the warm start
    std::span<const std::uint32_t> rods_;   // by point, the island that rods link it to; empty where there are none
    std::vector<std::uint32_t> disturbed_;  // points that are changed, or have lost a neighbour that pressed them
};

}  // namespace rapid
