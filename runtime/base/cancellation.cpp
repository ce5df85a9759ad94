#include "runtime/base/cancellation.h"

#include <utility>

namespace rapid {
namespace {

thread_local const Cancellation* innermost = nullptr;

}  // namespace

const Cancellation* Cancellation::current() { return innermost; }

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
    if (innermost) innermost->check();
}

Error Cancellation::placed(Error error) const
{
    const std::lock_guard lock(mutex_);
    if (scope_) error.in_node(scope_->node_).at(scope_->location_);
    return error;
}

Cancellation::NodeScope::NodeScope(const std::string& node, const Location& location)
    : of_(innermost), node_(node), location_(location)
{
    if (!of_) return;
    const std::lock_guard lock(of_->mutex_);
    before_ = std::exchange(of_->scope_, this);
}

Cancellation::NodeScope::~NodeScope()
{
    if (!of_) return;
    const std::lock_guard lock(of_->mutex_);
    of_->scope_ = before_;
}

Cancellation::Scope::Scope(const Cancellation* cancellation) : before_(std::exchange(innermost, cancellation)) {}
Cancellation::Scope::~Scope() { innermost = before_; }

}  // namespace rapid
