// The time of the point that a kernel on this thread works on, for what it asks of shapes that move.
#pragma once

#include <cstdint>
#include <optional>

#include "runtime/graph/step_shape.h"

namespace rapid {

class KernelMoment {
public:
    // From now on, until it is destroyed, on this thread. times: of the chunk's points, s since the start; null: the
    // end of the step. at: the point that is worked on.
    KernelMoment(const double* times, const std::int32_t* at);
    ~KernelMoment();
    KernelMoment(const KernelMoment&) = delete;
    KernelMoment& operator=(const KernelMoment&) = delete;

    // The present, in seconds since the start; nothing: the end of the step.
    static std::optional<double> time();
    // The present, in seconds since the step of the shape began.
    static double since_begin(const StepShape& shape);

private:
    const double* times_;
    const std::int32_t* at_;
    const KernelMoment* outer_;
};

}  // namespace rapid
