// Writes lua/rapid.d.lua, the graph language for the Lua language server: any editor then completes and checks nodes,
// parameters, makers and kernels. The command is `rapid nodes --annotations`.
#pragma once

#include <string>

#include "runtime/graph/registry.h"

namespace rapid {

std::string annotations_of(const Registry& registry);

}  // namespace rapid
