// What a value of a graph file is, too, that knows where it is written.
#pragma once

#include "runtime/base/error.h"

namespace rapid {

class Located {
public:
    virtual ~Located() = default;
    virtual Location location() const = 0;
};

}  // namespace rapid
