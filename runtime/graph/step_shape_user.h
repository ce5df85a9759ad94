// An argument of a node that asks shapes which move, such as a function of a point: it is told of each step before the
// node is evaluated.
#pragma once

#include "runtime/base/frame.h"

namespace rapid {

class StepShapeUser {
public:
    virtual ~StepShapeUser() = default;

    virtual bool asks_moving_shapes() const = 0;
    // The step that ends at `frame`. On one thread. Error: of a motion, or of a file of a sequence.
    virtual void begin_step(const FrameClock& clock, const Frame& frame) const = 0;
};

}  // namespace rapid
