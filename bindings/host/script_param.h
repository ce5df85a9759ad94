// Reads the parameters of a node type defined by rapid.node from their declarations.
#pragma once

#include <string>

#include "runtime/graph/param.h"

namespace rapid {

// Type of a parameter that names a group which its kernel changes.
inline constexpr std::string_view group_param_type = "name of a group";

// Reads a declaration such as { "float", default = 1, min = 0, unit = "1/s", doc = "..." }; its values are assigned to
// ScriptFields. Throws Error if the declaration or its default is wrong.
Param read_param(const std::string& name, const Value& declared, const std::string& node_name);

// Returns a field of a definition, or null if it is not given.
const Value* find_field(const Table& table, const char* name);

// Returns a string of a definition, empty if it is not given. what: the definition, for the error.
std::string text_field(const Table& table, const char* name, const std::string& what);

}  // namespace rapid
