// Twins of constraints (Constraint::twin), for constraints that store their memory as a member.
#pragma once

#include <memory>

#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Returns a copy of `constraint` that continues the `memory` of `before`, or a copy of its own memory if `before` is
// null.
template <class C, class Memory>
std::shared_ptr<const Constraint> twin_of(const C& constraint, std::shared_ptr<Memory> C::*memory,
                                          const Constraint* before)
{
    auto twin = std::make_shared<C>(constraint);
    const auto* known = dynamic_cast<const C*>(before);
    twin.get()->*memory = known ? known->*memory : std::make_shared<Memory>(*(constraint.*memory));
    return twin;
}

// Interface of a constraint that saves and loads its memory.
class Remembering {
public:
    virtual ~Remembering() = default;
    virtual void save(StateWriter& to) const = 0;
    virtual void load(StateReader& from) const = 0;
};

// Base of a constraint C whose memory belongs to its node.
template <class C, class Memory>
class RememberingConstraint : public Constraint, public Remembering {
public:
    std::shared_ptr<Memory> memory;

    std::shared_ptr<const Constraint> twin(const Constraint* before) const override
    {
        return twin_of<C, Memory>(static_cast<const C&>(*this), &C::memory, before);
    }
    void save(StateWriter& to) const override { to(*memory); }
    void load(StateReader& from) const override { from(*memory); }
};

}  // namespace rapid
