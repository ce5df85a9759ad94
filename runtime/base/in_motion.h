// Objects of one frame that a moving or deforming object was evaluated for.
#pragma once

#include <memory>

#include "runtime/base/object.h"

namespace rapid {

// A mesh or level set that is the state of a moving object at one frame. Users that can follow the motion replace it by
// in_motion(); for all others it is at rest.
class StateInMotion {
public:
    virtual ~StateInMotion() = default;
    virtual ObjectPtr in_motion() const = 0;  // null if nothing moves
};

// Returns the moving object of which this one is a state, if it is a T; otherwise null.
template <class T = Object>
std::shared_ptr<const T> in_motion(const ObjectPtr& object)
{
    const auto* state = dynamic_cast<const StateInMotion*>(object.get());
    return state ? std::dynamic_pointer_cast<const T>(state->in_motion()) : nullptr;
}

}  // namespace rapid
