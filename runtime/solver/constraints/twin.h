// Twins of constraints (Constraint::twin), for those whose memory is a member of the constraint.
#pragma once

#include <memory>

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// A constraint like `constraint`, whose `memory` is that of `before`, or else a copy.
template <class C, class Memory>
std::shared_ptr<const Constraint> twin_of(const C& constraint, std::shared_ptr<Memory> C::*memory,
                                          const Constraint* before)
{
    auto twin = std::make_shared<C>(constraint);
    const auto* known = dynamic_cast<const C*>(before);
    twin.get()->*memory = known ? known->*memory : std::make_shared<Memory>(*(constraint.*memory));
    return twin;
}

}  // namespace rapid
