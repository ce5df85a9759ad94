// Final penetration correction of contacts between points of very different masses.
//
// A heavy point on a light one that a shape bears, itself or through others, would sink into it: in a sweep the shape
// gives back no more than the lighter weighs, and iterations would have to be as many as the ratio of the masses. What
// is left too deep is moved out, with the lighter point as a wall.
#pragma once

#include <cstdint>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_pack.h"

namespace rapid {

class HeavyContacts {
public:
    // Before a frame: whether masses differ by more than iterations can do.
    void begin(const Substep& step);
    bool any() const { return any_; }

    // A point that presses on a supported one is supported, through one point more.
    static void pass_on_support(const ContactPack& pack, Substep& step);

    static void correct(const PairContact& contact, const ContactMaterial& material, Substep& step);

private:
    bool any_ = false;
};

}  // namespace rapid
