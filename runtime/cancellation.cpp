#include "runtime/cancellation.h"

#include <utility>

namespace rapid {
namespace {

thread_local const Cancellation* of_thread = nullptr;

}  // namespace

const Cancellation* Cancellation::current() { return of_thread; }

void Cancellation::check_current()
{
    if (of_thread) of_thread->check();
}

Cancellation::Scope::Scope(const Cancellation* cancellation) : before_(std::exchange(of_thread, cancellation)) {}
Cancellation::Scope::~Scope() { of_thread = before_; }

}  // namespace rapid
