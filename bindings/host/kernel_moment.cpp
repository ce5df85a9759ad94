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

std::optional<double> KernelMoment::time()
{
    if (!current || !current->times_ || *current->at_ < 0) return std::nullopt;
    return current->times_[*current->at_];
}

double KernelMoment::since_begin(const StepShape& shape)
{
    const std::optional<double> now = time();
    return now ? *now - shape.begin() : shape.duration();
}

}  // namespace rapid
