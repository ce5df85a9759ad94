// Enforces --memory: ends a command that exceeds it.
#pragma once

#include <functional>
#include <string>

#include "runtime/base/cancellation.h"
#include "runtime/base/memory_watch.h"

namespace rapid {

// While it lives, work on this thread ends with an Error of the node if the process exceeds --memory. file: the graph.
// end: called from another thread if that comes too late; it must not return.
class MemoryLimit {
public:
    MemoryLimit(const std::string& file, const std::function<void(const std::string& message)>& end)
        : watch_(
              MemoryWatch::now(), [this](const Error& error) { cancellation_.request(error); },
              [this, file, end](const Error& error) {
                  end(cancellation_.placed(error).at({file, 0}).what());
              })
    {
    }

private:
    Cancellation cancellation_;
    Cancellation::Scope scope_{&cancellation_};
    MemoryWatch watch_;
};

}  // namespace rapid
