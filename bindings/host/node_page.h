// The page of a node type, for people and for programs.
#pragma once

#include <string>

#include "runtime/graph/node.h"

namespace rapid {

std::string page_of(const NodeType& type);
std::string json_of(const NodeType& type);  // an object, in one line

}  // namespace rapid
