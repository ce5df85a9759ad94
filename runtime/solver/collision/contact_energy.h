// The energy that contacts add to points and remove from them, for the audit of a method (numerics.md, Collision).
#pragma once

#include <cmath>

namespace rapid {

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

}  // namespace rapid
