// A grid that changes with time as it goes through one step. It is made ahead, on the calling thread, when functions of
// the frame are called (step_shape.h).
#pragma once

#include "runtime/frame.h"
#include "runtime/graph/value.h"
#include "runtime/shapes/level_set/grid_sequence.h"

namespace rapid {

// Whether an object is a sequence of grids.
bool is_grid_sequence(const Object& object);

// A sequence of grids in the step that ends at `frame`: a vector grid, or a fog; null for any other object. Error: of a
// file.
ObjectPtr step_grid(const ObjectPtr& object, const FrameClock& clock, const Frame& frame);

}  // namespace rapid
