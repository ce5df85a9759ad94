// Converts a program's objects and nodes into those of the runtime.
#pragma once

#include "include/rapid/offers.h"
#include "runtime/base/object.h"
#include "runtime/graph/node_type.h"

namespace rapid {

// guarded: callbacks write into our arrays, which end with a pattern that shows writes past the end. Throws Error if an
// array is missing or wrong.
ObjectPtr make_object(const std::string& name, const HostObject& offered, bool guarded);
NodeType make_type(const HostNode& node, bool guarded);

}  // namespace rapid
