// Builds graphs like those of a graph file, from the node types of nodes.cpp.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/graph/plan.h"
#include "runtime/graph/registry.h"
#include "tests/test.h"

namespace rapid::test {

// Number of evaluations of each node, by name, and of those at the first frame by start().
inline std::map<std::string, int> evaluations, starts;

// The line of a node in its file is its index among all nodes, from 1. Clears the counts.
class GraphUnderTest {
public:
    GraphUnderTest()
    {
        graph_.file = "scene.lua";
        evaluations.clear();
        starts.clear();
    }

    NodePtr node(const std::string& type, std::vector<NodePtr> inputs = {}, std::map<std::string, Value> arguments = {},
                 std::string name = "")
    {
        const std::uint64_t serial = graph_.nodes.size();
        const int line = static_cast<int>(serial) + 1;
        if (name.empty()) name = type + std::to_string(++count_[type]);
        graph_.nodes.push_back(std::make_shared<Node>(Node{&registry_.at(type),
                                                           std::move(name),
                                                           {"scene.lua", line},
                                                           serial,
                                                           std::move(inputs),
                                                           std::move(arguments)}));
        return graph_.nodes.back();
    }

    const Graph& returning(const NodePtr& node) { return returning(std::map<std::string, NodePtr>{{"main", node}}); }
    const Graph& returning(std::map<std::string, NodePtr> outputs)
    {
        graph_.outputs = std::move(outputs);
        return graph_;
    }

private:
    Registry registry_;
    Graph graph_;
    std::map<std::string, int> count_;
};

// Returns a parameter that is a function of the frame.
template <class F>
Value of_frame(F f)
{
    struct Function : FrameFunction {
        explicit Function(F f) : body(std::move(f)) {}
        Value call(const Frame& frame) const override { return body(frame); }
        F body;
    };
    return std::shared_ptr<const FrameFunction>(std::make_shared<Function>(std::move(f)));
}

// Returns the message of a failed call, with file, line and node; empty if it did not fail.
template <class F>
std::string error_of(const F& f)
{
    try {
        f();
        return "";
    } catch (const Error& error) {
        return error.what();
    }
}

}  // namespace rapid::test
