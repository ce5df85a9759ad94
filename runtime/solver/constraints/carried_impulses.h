// Constraints that start a substep with the impulses of the previous one and act alongside rods and springs.
#pragma once

#include <cstdint>
#include <span>

namespace rapid {

// An interface that such a Coupling also implements.
class CarriedImpulses {
public:
    virtual ~CarriedImpulses() = default;

    // Is called before warm_start(). islands: by point; points linked by rods and springs share a number. Empty if
    // there are no rods or springs. Valid for the substep.
    virtual void follow_rods(std::span<const std::uint32_t> islands) = 0;
};

}  // namespace rapid
