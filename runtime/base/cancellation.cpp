#include "runtime/base/cancellation.h"

#include <utility>

namespace rapid {
namespace {

thread_local const Cancellation* of_thread = nullptr;

}  // namespace

const Cancellation* Cancellation::current() { return of_thread; }

void Cancellation::request(const Error& why)
{
    const std::lock_guard lock(mutex_);
    if (!is_requested()) why_ = why;
    requested_.store(true, std::memory_order_relaxed);
}

void Cancellation::forget()
{
    const std::lock_guard lock(mutex_);
    requested_.store(false, std::memory_order_relaxed);
}

void Cancellation::fail() const
{
    const std::lock_guard lock(mutex_);
    throw Error(why_);
}

void Cancellation::check_current()
{
    if (of_thread) of_thread->check();
}

Error Cancellation::placed(Error error) const
{
    const std::lock_guard lock(mutex_);
    if (place_) error.in_node(place_->node_).at(place_->location_);
    return error;
}

Cancellation::Place::Place(const std::string& node, const Location& location)
    : of_(of_thread), node_(node), location_(location)
{
    if (!of_) return;
    const std::lock_guard lock(of_->mutex_);
    before_ = std::exchange(of_->place_, this);
}

Cancellation::Place::~Place()
{
    if (!of_) return;
    const std::lock_guard lock(of_->mutex_);
    of_->place_ = before_;
}

Cancellation::Scope::Scope(const Cancellation* cancellation) : before_(std::exchange(of_thread, cancellation)) {}
Cancellation::Scope::~Scope() { of_thread = before_; }

}  // namespace rapid
