// The functions that Rapid's own Lua files call, and the objects that only they know.
#pragma once

#include <memory>
#include <string>

#include "runtime/graph/node.h"
#include "runtime/object.h"

namespace rapid {

class State;

// `rapid.attr "bounce"`.
class AttributeName : public Object {
public:
    explicit AttributeName(std::string attribute) : name(std::move(attribute)) {}
    std::string_view kind() const override { return "attribute"; }

    const std::string name;
};

// A node, as graph code holds it.
class NodeHandle : public Object {
public:
    explicit NodeHandle(NodePtr held) : node(std::move(held)) {}
    std::string_view kind() const override { return "node"; }

    const NodePtr node;
};

// Pushes the table of native functions that lua/host.lua is given. chunk_header: the text of lua/chunk.h.
void push_natives(State& state, const std::string& chunk_header);

}  // namespace rapid
