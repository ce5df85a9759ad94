// What contacts do to the energy of points: the audit of a method (numerics.md, Collision).
#pragma once

#include <cmath>

namespace rapid {

// J, kinetic and in the constant acceleration of each sub-step. A contact with what is at rest can add none: what is
// added is the work of shapes that move, and the error of a method.
struct ContactEnergy {
    double added = 0, lost = 0;  // summed over points and sub-steps apart

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
