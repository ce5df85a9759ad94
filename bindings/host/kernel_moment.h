// The time of the point that a kernel processes on this thread, for queries of moving shapes.
#pragma once

#include <cstdint>
#include <optional>

#include "runtime/graph/step_shape.h"

namespace rapid {

class KernelMoment {
public:
    // Applies on this thread until destruction. times: the chunk's points, s since the start; null means the end of the
    // step. at: the point being processed.
    KernelMoment(const double* times, const std::int32_t* at);
    ~KernelMoment();
    KernelMoment(const KernelMoment&) = delete;
    KernelMoment& operator=(const KernelMoment&) = delete;

    // Returns the current time, s since the start, or nothing for the end of the step.
    static std::optional<double> time();
    // Returns the current time, s since the beginning of the shape's step.
    static double since_begin(const StepShape& shape);

private:
    const double* times_;
    const std::int32_t* at_;
    const KernelMoment* outer_;
};

}  // namespace rapid
