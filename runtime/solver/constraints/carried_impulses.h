// Constraints that begin a sub-step with the impulses of the last one, beside rods and springs.
#pragma once

#include <cstdint>
#include <span>

namespace rapid {

// What a Coupling is, too, that does.
class CarriedImpulses {
public:
    virtual ~CarriedImpulses() = default;

    // Before warm_start(). islands: by point; points that rods and springs link have the same. Empty where there are
    // none. Valid for the sub-step.
    virtual void follow_rods(std::span<const std::uint32_t> islands) = 0;
};

}  // namespace rapid
