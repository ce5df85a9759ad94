// Contacts between points: non-penetrating spheres with friction and restitution (paper §5.1; Macklin et al. 2014).
//
//   C = |P_i - P_j| - (r_i + r_j) >= 0
//
// Gauss-Seidel starts with the normal and tangential impulses of the previous substep, so its sweeps only have to find
// changes. A pile at rest is then already solved, and one sweep per substep suffices at any height; without warm
// starting it would sink by 2 N g dt².
//
// An overlap that exists at the beginning of a substep must not become deeper. It is recovered without adding speed,
// so overlapping newborn points separate gently.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/neighbour_list.h"
#include "runtime/solver/constraints/pair_blocks.h"
#include "runtime/solver/constraints/pair_impulses.h"
#include "runtime/solver/constraints/sleep.h"

namespace rapid {

// Sleep of points in contact: impacts and load changes wake them, overlaps keep them awake.
class ContactSleep {
public:
    // Null if no point may sleep in this frame.
    void join(Sleep* sleep) { sleep_ = sleep; }
    Sleep* sleep() const { return sleep_; }
    void wake_both(std::uint32_t i, std::uint32_t j) const
    {
        if (sleep_) sleep_->wake(i), sleep_->wake(j);
    }

    bool any() const { return sleep_ && sleep_->any(); }
    bool asleep(std::uint32_t i) const { return sleep_ && sleep_->asleep(i); }
    bool both_asleep(std::uint32_t i, std::uint32_t j) const { return asleep(i) && asleep(j); }

    // Wakes sleepers that are hit, and those that the shock reaches: each passes half of it to the points that it
    // touches. They continue with their free motion. Returns true if any wakes.
    bool wake_by_impact(const ContactPacks& packs, const PairImpulses& impulses, const ContactMaterial& material,
                        Substep& step);

    // Wakes the sleeper of a contact if its load differs from the one with which it fell asleep.
    void wake_by_load(const PairContact& contact, const PairImpulses& impulses, const Substep& step) const;

    // Is called at the end of a frame. Reports the loads of all points and stores their resting impulses. Points with
    // deep overlaps, and all that touch them, are kept awake because they have to give way.
    void report(const ContactPacks& packs, PairImpulses& impulses, const ContactMaterial& material,
                const Substep& step) const;

private:
    Sleep* sleep_ = nullptr;
    std::vector<double> shock_;  // N s, by point
};

// Final penetration correction of contacts between points of very different masses.
//
// A heavy point on a light one that a shape supports, directly or through others, would sink into it: in one sweep,
// the shape returns at most the impulse of the lighter point, so the iterations needed grow with the mass ratio.
// Remaining deep penetration is removed by moving the heavier point, with the lighter one as a wall.
class HeavyContacts {
public:
    // Is called before a frame. Finds out if masses differ by more than iterations can handle.
    void begin(const Substep& step);
    bool any() const { return any_; }

    // Marks a point that presses on a supported one as supported, one point further away.
    static void pass_on_support(const ContactPack& pack, Substep& step);

    static void correct(const PairContact& contact, const ContactMaterial& material, Substep& step);

private:
    bool any_ = false;
};

// Mass scaling (Macklin et al. 2014): in a contact of two points, the upper one counts as lighter.
//
// With c = n·up, the upper point counts as e^(k c) times lighter than the lower one, as if mass decreased by e^(-k h /
// (r_i + r_j)) with the height h. Loads then do not add up. A contact carries
//
//   p = m g dt / (2 c sinh(k c / 2)),   as   w e^(k c / 2) c p = g dt + w e^(-k c / 2) c p
//
// under a stack of any height, w = 1/m. A warm-start impulse beyond that, as left by a fall, is dropped: its release
// would throw the light points upwards, like the end of a whip.
class MassScaling {
public:
    // Sets k, at least 0.
    void set(double k) { k_ = k; }
    bool is_set() const { return k_ > 0; }
    void begin(const Substep& step) { active_ = k_ > 0 && !step.up.isZero(0); }

    void apply(ContactPack& pack, const PointPack& a, const PointPack& b, const Substep& step) const
    {
        if (!active_) return;
        for (std::uint32_t l = 0; l < lanes; ++l) {
            const double c = pack.n[l].dot(step.up), scale = std::exp(0.5 * k_ * c);
            pack.scale[l] = static_cast<float>(scale);
            pack.effective_mass[l] = static_cast<float>(1 / (scale * a.w[l] + b.w[l] / scale));
            const double carried =
                step.max_acceleration * step.dt / ((c > 0 ? a.w[l] : b.w[l]) * std::abs(c * (scale - 1 / scale)));
            pack.normal_impulse[l] = pack.carried_impulse[l] =
                std::min(pack.normal_impulse[l], static_cast<float>(0.5 * carried));
        }
    }

    // Calls f(weights), with weights(pack, a, b) the inverse masses of the contacts' points. Unscaled masses use a
    // separate type, at no cost.
    template <class F>
    void with_weights(const F& f) const
    {
        struct Weights {
            Doubles a, b;
        };
        if (!active_)
            f([](const ContactPack&, const PointPack& a, const PointPack& b) { return Weights{a.w, b.w}; });
        else
            f([](const ContactPack& pack, const PointPack& a, const PointPack& b) {
                const Doubles scale = widen(pack.scale);
                return Weights{scale * a.w, b.w / scale};
            });
    }

private:
    double k_ = 0;
    bool active_ = false;  // in this substep
};

class Contacts : public Coupling, public CarriedImpulses {
public:
    // Is called before a frame. Impulses are matched by the points' ids. Throws as ContactMaterial does.
    void follow(const PointSet& points, const ContactOptions& options, const std::string& group);

    void join(Sleep* sleep) override;
    bool bounces() const override { return material_.bounces; }
    const ContactMaterial* turns() const override { return material_.turns() ? &material_ : nullptr; }
    bool only_dissipates() const override { return !material_.turns(); }  // except by mass scaling
    bool keeps_momentum() const override { return !scaling_.is_set(); }
    std::span<const float> recorded() const override;
    std::span<const float> radii() const override { return material_.radius; }
    // Returns true if points were created inside each other in the last frame and still violate a contact.
    bool births_overlap() const { return births_overlap_; }
    void link(EnergyIslands& islands) const override;
    void detect(Substep& step) override;
    bool solve_impacts(Substep& step, std::uint32_t sweep) override;
    void follow_rods(std::span<const std::uint32_t> islands) override { rods_ = islands; }
    void exclude(std::span<const ContactPair> pairs) override { excluded_ = pairs; }
    void warm_start(Substep& step) override;
    void project(Substep& step) override;
    void solve_velocities(Substep& step) override;
    void add_forces(const Substep& step) override;
    void correct_penetration(Substep& step) override;
    void close(Substep& step, FrameFigures& figures) override;

    // Stores all results of the last frame's search, because the next frame may reuse them.
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
    // When a point was created: before the frame, or in it, apart from others or deep inside one.
    enum class Birth : std::uint8_t { Before, Apart, Inside };

    // Returns true if all indices of a loaded snapshot are in range.
    bool is_consistent() const;
    void renumber(const Column<std::int64_t>& ids, std::span<const std::uint32_t> index);
    void search(const Substep& step);
    void follow_strays(const Substep& step);
    void note_hits(std::size_t from);
    void measure_reaches(std::size_t from);
    void update_contacts(Substep& step);
    void find_overlapping_births(const Substep& step);
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
    PairImpulses impulses_, previous_;  // in the order of the blocks; and of the previous list
    // Marks pairs hit by an impact in this substep. hit_before_ has the hit pairs of earlier lists.
    std::vector<std::uint8_t> hit_;
    std::vector<ContactPair> hit_before_;
    std::vector<float> reach_;  // m, by pair; padded for whole packs
    ContactPacks packs_;
    std::vector<std::vector<const ContactPack*>> deep_;  // by block: overlaps that stay deep after a sweep
    MassScaling scaling_;
    HeavyContacts heavy_;
    ContactSleep sleep_;

    bool begins_frame_ = true, list_is_stale_ = true, backwards_ = false;
    bool impacts_moved_ = false;             // impacts moved points after their contacts were found
    double per_dt_ = 0;                      // 1/s, in the last substep
    double search_seconds_ = 0;              // in this frame
    std::vector<Vec3d> before_;              // positions before the warm start
    std::span<const std::uint32_t> rods_;    // by point: its island of rods; empty if there are no rods
    std::span<const ContactPair> excluded_;  // sorted, joined by rods
    std::vector<Birth> births_;              // by point
    std::vector<Vec3f> birthplaces_;         // of points created in the frame
    bool births_overlap_ = false;
    std::vector<std::uint32_t> disturbed_;  // points that changed, or that lost a neighbour pressing on them
};

}  // namespace rapid
