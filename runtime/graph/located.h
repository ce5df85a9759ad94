// An interface of values in a graph file that know their location.
#pragma once

#include "runtime/base/error.h"

namespace rapid {

class Located {
public:
    virtual ~Located() = default;
    virtual Location location() const = 0;
};

}  // namespace rapid
