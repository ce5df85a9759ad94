// The objects and nodes of a program as the runtime has its own.
#pragma once

#include "include/rapid/offers.h"
#include "runtime/base/object.h"
#include "runtime/graph/node_type.h"

namespace rapid {

// guarded: callbacks write into arrays of ours, behind which a pattern tells whether they go past the end.
// Error: an array that is missing or wrong.
ObjectPtr make_object(const std::string& name, const HostObject& offered, bool guarded);
NodeType make_type(const HostNode& node, bool guarded);

}  // namespace rapid
