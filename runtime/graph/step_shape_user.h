// An argument of a node that queries moving shapes, such as a function of a point. It is notified of each step before
// the node is evaluated.
#pragma once

#include "runtime/base/frame.h"

namespace rapid {

class StepShapeUser {
public:
    virtual ~StepShapeUser() = default;

    virtual bool queries_moving_shapes() const = 0;
    // Begins the step that ends at `frame`. Must be called on one thread. Throws the Error of a motion, or of a file
    // of a sequence.
    virtual void begin_step(const FrameClock& clock, const Frame& frame) const = 0;
};

}  // namespace rapid
