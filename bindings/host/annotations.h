// lua/rapid.d.lua: the graph language as the Lua language server reads it, so that any editor completes and checks
// nodes, parameters, makers and kernels. Written by `rapid nodes --annotations`.
#pragma once

#include <string>

#include "runtime/graph/registry.h"

namespace rapid {

std::string annotations_of(const Registry& registry);

}  // namespace rapid
