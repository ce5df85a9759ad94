// Sleep of points in contact: impacts and load changes wake them, overlaps keep them awake.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/pair_impulses.h"
#include "runtime/solver/constraints/sleep.h"

namespace rapid {

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

}  // namespace rapid
