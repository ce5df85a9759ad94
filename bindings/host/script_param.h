// The parameters of a node type that rapid.node defines, read from their declarations.
#pragma once

#include <string>

#include "runtime/graph/param.h"

namespace rapid {

// The type of a parameter that names a group which its kernel changes.
inline constexpr std::string_view group_param_type = "name of a group";

// { "float", default = 1, min = 0, unit = "1/s", doc = "..." }. It is assigned to ScriptFields. Error: what is wrong
// with the declaration, or with its default.
Param read_param(const std::string& name, const Value& declared, const std::string& node_name);

// A field of a definition; null where it is not given.
const Value* find_field(const Table& table, const char* name);

// A text of a definition; empty where it is not given. what: the definition, for the error.
std::string text_field(const Table& table, const char* name, const std::string& what);

}  // namespace rapid
