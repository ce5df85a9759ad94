// Node types and nodes: parameters, uses of attributes, and the operator that does the work.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/base/object.h"
#include "runtime/graph/evaluation.h"
#include "runtime/graph/param.h"
#include "runtime/graph/simulation.h"

namespace rapid {

// The attributes and groups that a node reads, writes or makes.
struct Uses {
    std::vector<std::string> reads, writes;
    std::vector<std::string> may;  // names that may be attributes; the known ones are read
    std::vector<AttributeSpec> makes;
    std::vector<AttributeSpec> defaults;  // fallback values, whichever node makes the attribute
    std::vector<std::string> takes;       // optional inputs: read if another node makes them
    std::vector<std::string> gives;       // optional outputs: written if another node reads them
    std::vector<std::string> reads_groups, takes_groups, makes_groups;
    std::vector<std::string> joins_groups;  // the part of makes_groups that the node writes point by point
    bool reads_all = false;                 // may read every attribute that is made

    // For points of the nodes among its arguments: attributes read, and attributes read if they are
    // made.
    std::vector<std::string> reads_of_source, takes_of_source, reads_groups_of_source;

    // Input of Operator::uses: the parameters that are functions of the frame, whose values will change; and the
    // attributes made by the nodes up to those among its arguments.
    std::set<std::string> functions;
    std::vector<AttributeSpec> source_makes;
};

class PointEdit;

// The behaviour of a node; one object per node and run.
class Operator {
public:
    virtual ~Operator() = default;
    virtual void* fields() = 0;
    virtual Flow evaluate(std::span<Flow> inputs, const Evaluation& now) = 0;
    virtual Flow start(std::span<Flow> inputs, const Evaluation& now) = 0;
    virtual void uses(Uses& uses) const = 0;
    virtual void check() const = 0;

    // Returns this if it edits points one by one (point_edit.h), and can thus be fused with its neighbours.
    virtual const PointEdit* as_point_edit() const { return nullptr; }
};

// Parts of a frame's work that a scene may need.
enum class Stage {
    Emission,
    Script,  // implied by a Lua function among the arguments
    Forces,
    Integration,
    Collision,
    ContactGrid,
    Constraints,
    ErrorEstimate,
    Writing,
};

enum class NodeKind {
    Source,   // no input: create
    Points,   // changes points; a pure function of its input and arguments unless `varies`
    Dynamic,  // adds a force, collider or constraint
    Merge,    // several inputs
    Solve,    // advances the points, and feeds them back to its Create
};

struct NodeType {
    std::string name, doc;
    std::string counted_as;  // nodes without a name of their own are numbered together with this type; empty: its own
    std::string defined_in;  // the file of a type written in Lua; empty for native types
    NodeKind kind = NodeKind::Points;
    std::vector<Param> params;
    std::optional<Param> rest;  // for arguments of any other name; its `name` is then that name
    Uses uses;                  // of every node of this type; Operator::uses adds those of a single node
    std::vector<Stage> stages;  // needed by nodes of this type
    bool varies = false;        // the result may change from frame to frame with the same inputs and arguments
    std::function<std::unique_ptr<Operator>()> make;

    bool has(Stage stage) const { return std::find(stages.begin(), stages.end(), stage) != stages.end(); }
    // Returns null if there is no parameter of that name. (`name` is a parameter only if it is declared, as for
    // :group; otherwise it names the node.)
    const Param* find(std::string_view param) const;
    std::vector<std::string> param_names() const;  // without internal ones
};

// A node as written in the graph file. Immutable; its inputs were created before it.
struct Node {
    const NodeType* type;
    std::string name;
    Location location;
    std::uint64_t serial;  // order of creation: every node comes after its inputs
    std::vector<std::shared_ptr<const Node>> inputs;
    std::map<std::string, Value> arguments;
};

using NodePtr = std::shared_ptr<const Node>;

// A node as a value: in graph code, and as an argument of a node that reads its points (spawn's `from`).
class NodeHandle : public Object {
public:
    static constexpr std::string_view param_type = "node";
    explicit NodeHandle(NodePtr held) : node(std::move(held)) {}
    std::string_view kind() const override { return "node"; }

    const NodePtr node;
};

}  // namespace rapid
