// Formats the facts after a parameter's documentation, on its page and in an editor.
#pragma once

#include <string>

#include "runtime/graph/param.h"

namespace rapid {

// "[number, m/s, at least 0, default 0.5, takes rapid.attr]", "[integer, default 1, constant]"
std::string facts_of(const Param& param);

}  // namespace rapid
