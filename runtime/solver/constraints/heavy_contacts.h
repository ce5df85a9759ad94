// Final penetration correction of contacts between points of very different masses.
//
// A heavy point on a light one that a shape supports, directly or through others, would sink into it: in one sweep,
// the shape returns at most the impulse of the lighter point, so the iterations needed grow with the mass ratio.
// Remaining deep penetration is removed by moving the heavier point, with the lighter one as a wall.
#pragma once

#include <cstdint>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_pack.h"

namespace rapid {

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

}  // namespace rapid
