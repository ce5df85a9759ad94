// A node type: its one declaration, from which validation, `rapid nodes`, the Lua method, the annotations and the plan
// come.
//
//   struct Gravity {
//       Vec3d g;
//       static NodeType declare()
//       {
//           return node<Gravity>("gravity", "Accelerates all points alike.")
//               .param(&Gravity::g, "g", Vec3d(0, -9.81, 0), any_number(), "m/s²", "acceleration");
//       }
//       ...
//   };
//   RAPID_NODE(Gravity);
//
// What the node does is the member function that its struct has; one of
//
//   void edit(PointSet&, const Evaluation&)                  changes points at once (one by one: see point_edit.h)
//   void contribute(const Chunk&, Forces&) const             a force: Solve calls it (solver/dynamics.h)
//   std::optional<Uniform> uniform() const                   a force that is uniform; also besides contribute()
//   bool add_potential(const Chunk&, std::span<double>) const    besides these: the energy of which it is the slope
//   auto dynamic(const Evaluation&) const                    a shared pointer to a Collider, Constraint, Action, Force
//   Flow evaluate(std::span<Flow>, const Evaluation&)        anything else (Create, Merge, Solve)
//
// and, where it needs them,
//
//   Flow start(std::span<Flow>, const Evaluation&)           at the first frame, where nodes between Create and
//                                                            Solve do not run; by default the first input passes
//   void uses(Uses&) const                                   names read, written or made, as the arguments say
//   void check() const                                       arguments that are legal one by one, but not together
//
// Fields are set from the arguments before each evaluation; other members are the node's state over a run. uses() and
// check() are asked with the fields as they are at the first frame.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/adopted_ids.h"
#include "runtime/graph/param.h"
#include "runtime/random.h"
#include "runtime/solver/collision/contact_energy.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/estimate/stiffness.h"

namespace rapid {

// One simulation: what a Create starts and its Solve feeds back. Shared by all flows that come from it.
struct Simulation {
    double fps = 24;
    std::int64_t start = 1;
    int subframes = 1;
    std::uint64_t seed = 0;
    std::int64_t next_id = 0;            // ids count all births from 0
    std::vector<AttributeSpec> columns;  // what the plan knows: these exist from the first frame on
    std::vector<std::string> groups;
    PointSet state;                                   // as Solve left it at the frame before
    std::map<const Simulation*, AdoptedIds> adopted;  // the ids here of points that came from other simulations
    bool trial = false;  // only what is stiff is asked for: of births a sample will do, and Solve leaves points alone

    FrameClock clock() const { return {fps, start, subframes}; }
    Frame frame(std::int64_t step) const { return clock().at_step(step); }
};

// What travels along an edge of the graph.
struct Flow {
    PointSet points;
    Dynamics dynamics;  // of the nodes upstream
    std::shared_ptr<Simulation> simulation;
};

// What goes before a group's name where attributes and groups are listed together, as in a .csv file's header.
inline const std::string group_prefix = "group:";

// A level set's band as a frame's collisions needed it (paper §4.3).
struct BandFigures {
    std::string node;
    double width = 0;  // m, on each side of the surface
    std::uint64_t voxels = 0;
    double seconds = 0;  // spent on it in this frame: 0 where it was there

    bool operator==(const BandFigures&) const = default;
};

// Counted while a frame runs (see `--stats`).
struct FrameFigures {
    std::uint64_t born = 0, died = 0, collisions = 0;
    std::uint64_t contact_limit = 0;     // points that ran into the limit of contacts in a step
    std::uint64_t beyond_tolerance = 0;  // points that would need more than max_substeps
    std::uint64_t trapped = 0;           // points deep in a shape, with no way out known
    int substeps = 0;
    double penetration_max = 0;
    double constraint_residual_max = 0;  // m
    ContactEnergy contact_energy;
    std::uint64_t constraint_rows = 0;    // that were active at the end of the frame
    std::uint64_t loose_constraints = 0;  // of them, those that were off by more than a tenth of their size
    std::uint64_t asleep = 0;             // points that slept at the end of the frame
    std::optional<Residual::Search> contact_search;
    std::vector<BandFigures> bands;  // by collide node, of those with a level set
    std::vector<double> errors;      // estimated, of the positions of a sample of the points, m
    // By how much the integrator has changed the energy of each of that sample since its birth, J/kg; and whether an
    // energy of motion is not defined, because of drags, scripts or couplings.
    std::vector<double> energy_drift;
    bool has_no_energy = false;
    std::vector<Stiffness> stiff;
    double script_seconds = 0, solve_seconds = 0;

    // Those of a frame's next part: what happens adds up, the worst stays, what holds at the end is the later's.
    void append(FrameFigures later);
};

// What a node is told when it is evaluated.
struct Evaluation {
    Frame frame;
    bool at_start = false;    // the first frame: the initial state, before any dynamics
    const std::string& node;  // its name
    const Location& location;
    RandomKey random;       // (seed, name)
    FrameFigures& figures;  // what this frame's statistics count
    // Said once in a run: without the frame, and without counts, which belong in the figures.
    std::vector<std::string>& warnings;
    // Hands a set to be written; empty where nothing may be written (check, explain, test).
    const std::function<void(const std::string& pattern, const PointSet& points)>& write;
    // What the plan has left out of this simulation (see PlannedAttribute); null: nothing.
    const std::set<std::string>* left_out = nullptr;

    // Whether the node that makes this attribute or group should.
    bool keeps(const std::string& name) const { return !left_out || !left_out->count(name); }
    bool keeps_group(const std::string& name) const { return keeps(group_prefix + name); }
};

// What a node adds to its chain: a D, made of the arguments, that knows whose it is.
template <class D, class... Arguments>
std::shared_ptr<D> dynamic_of(const Evaluation& now, const std::string& group, Arguments&&... arguments)
{
    auto made = std::make_shared<D>(std::forward<Arguments>(arguments)...);
    made->node = now.node;
    made->location = now.location;
    made->group = group;
    return made;
}

// Attributes and groups that a node reads, writes, or brings into being.
struct Uses {
    std::vector<std::string> reads, writes;
    std::vector<std::string> may;  // names that may be attributes: known ones among them are brought into being
    std::vector<AttributeSpec> makes;
    std::vector<AttributeSpec> defaults;  // what points without a value of their own get, whoever makes the attribute
    std::vector<std::string> takes;       // read where another node brings them into being, and not missed elsewhere
    std::vector<std::string> gives;       // written where something reads them, and not brought into being
    std::vector<std::string> reads_groups, takes_groups, makes_groups;
    std::vector<std::string> joins_groups;  // of makes_groups, those that the node writes point by point
    bool reads_all = false;                 // may read everything that is made: under names that are not known before

    // Given to Operator::uses: the parameters that are functions of the frame. Their values now are not all that come.
    std::set<std::string> functions;
};

class PointEdit;

// What a node does; one object a node and run.
class Operator {
public:
    virtual ~Operator() = default;
    virtual void* fields() = 0;
    virtual Flow evaluate(std::span<Flow> inputs, const Evaluation& now) = 0;
    virtual Flow start(std::span<Flow> inputs, const Evaluation& now) = 0;
    virtual void uses(Uses& uses) const = 0;
    virtual void check() const = 0;

    // This, where it edits points one by one (point_edit.h), and so can go together with its neighbours.
    virtual const PointEdit* as_point_edit() const { return nullptr; }
};

// The parts of a frame's work that a scene may have or lack.
enum class Stage {
    Emission,
    Script,  // of every node with a function: no node declares it
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
    Points,   // changes points; the same input and arguments give another result in another frame only if `varies`
    Dynamic,  // adds a force, collider or constraint
    Merge,    // several inputs
    Solve,    // advances the points, and feeds them back to its Create
};

struct NodeType {
    std::string name, doc;
    std::string defined_in;  // the file of a type written in Lua; empty for native ones
    NodeKind kind = NodeKind::Points;
    std::vector<Param> params;
    std::optional<Param> rest;  // takes arguments of any other name; its `name` is then that name
    Uses uses;                  // of every node of this type; a node's own come from Operator::uses
    std::vector<Stage> stages;  // that nodes of this type need
    bool varies = false;        // its result changes from frame to frame although inputs and arguments do not
    std::function<std::unique_ptr<Operator>()> make;

    // One of `params`; null where there is none of that name. `name` is a parameter where it is declared (`:group`);
    // elsewhere it names the node.
    const Param* find(std::string_view param) const;
    std::vector<std::string> param_names() const;  // those that users give
};

// A node as the graph file wrote it. Immutable; its inputs were made before it.
struct Node {
    const NodeType* type;
    std::string name;
    Location location;
    std::uint64_t serial;  // order of making: every node comes after its inputs
    std::vector<std::shared_ptr<const Node>> inputs;
    std::map<std::string, Value> arguments;
};

using NodePtr = std::shared_ptr<const Node>;

namespace detail {

template <class T>
class ForceOf : public Force {
public:
    explicit ForceOf(const T& fields) : fields_(fields) {}
    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        if constexpr (requires { fields_.contribute(chunk, forces); })
            fields_.contribute(chunk, forces);
        else
            forces.add(*fields_.uniform());
    }
    std::optional<Uniform> uniform() const override
    {
        if constexpr (requires { fields_.uniform(); })
            return fields_.uniform();
        else
            return std::nullopt;
    }
    bool add_potential(const Chunk& chunk, std::span<double> energy) const override
    {
        if constexpr (requires { fields_.add_potential(chunk, energy); })
            return fields_.add_potential(chunk, energy);
        else
            return Force::add_potential(chunk, energy);
    }

private:
    T fields_;
};

template <class T>
constexpr bool is_force = requires(const T& t, const Chunk& chunk, Forces& forces)
{
    t.contribute(chunk, forces);
}
|| requires(const T& t) { t.uniform(); };
template <class T>
constexpr bool has_dynamic = requires(const T& t, const Evaluation& now)
{
    t.dynamic(now);
};
template <class T>
constexpr bool has_edit = requires(T& t, PointSet& points, const Evaluation& now)
{
    t.edit(points, now);
};

template <class T>
class OperatorOf : public Operator {
public:
    void* fields() override { return &fields_; }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override
    {
        if constexpr (has_edit<T>) {
            fields_.edit(inputs[0].points, now);
            return std::move(inputs[0]);
        } else if constexpr (is_force<T> || has_dynamic<T>) {
            if (auto made = dynamic(now)) inputs[0].dynamics.add(std::move(made));
            return std::move(inputs[0]);
        } else {
            return fields_.evaluate(inputs, now);
        }
    }

    Flow start(std::span<Flow> inputs, const Evaluation& now) override
    {
        if constexpr (requires { fields_.start(inputs, now); })
            return fields_.start(inputs, now);
        else
            return std::move(inputs[0]);
    }

    void uses(Uses& uses) const override
    {
        if constexpr (requires { fields_.group; })
            if (!fields_.group.empty()) uses.reads_groups.push_back(fields_.group);
        if constexpr (requires { fields_.uses(uses); }) fields_.uses(uses);
    }

    void check() const override
    {
        if constexpr (requires { fields_.check(); }) fields_.check();
    }

private:
    auto dynamic(const Evaluation& now) const
    {
        if constexpr (has_dynamic<T>) {
            return fields_.dynamic(now);
        } else {
            std::string group;
            if constexpr (requires { fields_.group; }) group = fields_.group;
            return dynamic_of<ForceOf<T>>(now, group, fields_);
        }
    }

    T fields_;
};

}  // namespace detail

// Builds a declaration. T::make() makes its operator, where that is more than its fields. Every node has `name`, and
// all but sources and merges have `group`.
template <class T>
class Declaration {
public:
    Declaration(std::string name, std::string doc)
    {
        type_.name = std::move(name);
        type_.doc = std::move(doc);
        if constexpr (detail::is_force<T> || detail::has_dynamic<T>) type_.kind = NodeKind::Dynamic;
        if constexpr (detail::is_force<T>) type_.stages = {Stage::Forces};
        if constexpr (requires { T::make(); })
            type_.make = [] { return T::make(); };
        else
            type_.make = [] { return std::make_unique<detail::OperatorOf<T>>(); };
        if constexpr (requires(T t) { t.group; })
            param(&T::group, "group", Value(), any_number(), "", "acts on this group only");
    }

    // A parameter kept in `field`. fallback: its default, in the unit that users give; degrees ("deg") are kept as
    // radians.
    template <class F>
    Declaration& param(F T::*field, std::string name, Value fallback, Range range, std::string unit, std::string doc)
    {
        type_.params.push_back(
            param_of(field, std::move(name), std::move(fallback), range, std::move(unit), std::move(doc)));
        return *this;
    }

    // Takes arguments of any other name, as values of attributes of that name.
    Declaration& rest(std::map<std::string, AttributeValue> T::*field, std::string doc)
    {
        Param p;
        p.type = "attribute value";
        p.doc = std::move(doc);
        p.assign = [field](const Param& param, void* fields, const Value& value) {
            read_value(param, value, (static_cast<T*>(fields)->*field)[param.name]);
        };
        type_.rest = std::move(p);
        return *this;
    }

    // These speak of the parameter declared last.
    Declaration& required() { return last().required = true, *this; }
    Declaration& constant() { return last().of_the_frame = false, *this; }  // takes no function of the frame
    Declaration& or_nothing() { return last().may_be_nil = true, *this; }   // a function may return nil
    Declaration& choices(std::vector<std::string> names) { return last().choices = std::move(names), *this; }
    Declaration& of_type(std::string words) { return last().type = std::move(words), *this; }

    Declaration& kind(NodeKind kind) { return type_.kind = kind, *this; }
    Declaration& reads(std::string name) { return type_.uses.reads.push_back(std::move(name)), *this; }
    Declaration& writes(std::string name) { return type_.uses.writes.push_back(std::move(name)), *this; }
    Declaration& takes(std::string name) { return type_.uses.takes.push_back(std::move(name)), *this; }
    Declaration& stage(Stage stage) { return type_.stages.push_back(stage), *this; }
    Declaration& makes(AttributeSpec spec) { return type_.uses.makes.push_back(std::move(spec)), *this; }
    Declaration& varies() { return type_.varies = true, *this; }

    operator NodeType() const { return type_; }

private:
    Param& last() { return type_.params.back(); }

    NodeType type_;
};

template <class T>
Declaration<T> node(std::string name, std::string doc)
{
    return Declaration<T>(std::move(name), std::move(doc));
}

// Registers a native type while the program starts; used through RAPID_NODE, in the node's own file.
struct NodeRegistration {
    explicit NodeRegistration(NodeType (*declare)());
};
#define RAPID_NODE(Type) \
    static const ::rapid::NodeRegistration registration_of_##Type([] { return NodeType(Type::declare()); })

}  // namespace rapid
