#include "bindings/host/kernel_moment.h"

namespace rapid {
namespace {

thread_local const KernelMoment* moment_of_thread = nullptr;

}  // namespace

KernelMoment::KernelMoment(const double* times, const std::int32_t* at)
    : times_(times), at_(at), outer_(moment_of_thread)
{
    moment_of_thread = this;
}

KernelMoment::~KernelMoment() { moment_of_thread = outer_; }

std::optional<double> KernelMoment::time()
{
    if (!moment_of_thread || !moment_of_thread->times_ || *moment_of_thread->at_ < 0) return std::nullopt;
    return moment_of_thread->times_[*moment_of_thread->at_];
}

double KernelMoment::since_begin(const StepShape& shape)
{
    const std::optional<double> now = time();
    return now ? *now - shape.begin() : shape.duration();
}

}  // namespace rapid
