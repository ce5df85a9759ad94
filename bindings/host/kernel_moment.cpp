#include "bindings/host/kernel_moment.h"

namespace rapid {
namespace {

thread_local const KernelMoment* current = nullptr;

}  // namespace

KernelMoment::KernelMoment(const double* times, const std::int32_t* at) : times_(times), at_(at), outer_(current)
{
    current = this;
}

KernelMoment::~KernelMoment() { current = outer_; }

double KernelMoment::since_begin(const StepShape& shape)
{
    if (!current || !current->times_ || *current->at_ < 0) return shape.duration();
    return current->times_[*current->at_] - shape.begin();
}

}  // namespace rapid
