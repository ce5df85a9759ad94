// Sleep of points in contact: impacts and changes of load wake them, overlaps keep them awake.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/pair_impulses.h"

namespace rapid {

class ContactSleep {
public:
    // Wakes the sleepers that are hit, and those that the shock reaches: each passes half of it on to those that it
    // touches. They move on as their weight makes them. True if any wakes.
    bool wake_by_impact(const ContactPacks& packs, const PairImpulses& impulses, const ContactMaterial& material,
                        Substep& step);

    // Wakes the sleeper of a contact that is loaded otherwise than when it fell asleep.
    static void wake_by_load(const PairContact& contact, const PairImpulses& impulses, const Substep& step);

    // At the end of a frame: tells the loads of all points, keeps what they rest under, and keeps those awake that
    // overlap too far, with all that touch them: they have to give way.
    static void report(const ContactPacks& packs, PairImpulses& impulses, const ContactMaterial& material,
                       const Substep& step);

private:
    std::vector<double> shock_;  // N s, of each point
};

}  // namespace rapid
