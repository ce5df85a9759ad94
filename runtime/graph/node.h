// The declaration of a node type. From it come validation, `rapid nodes`, the Lua method, the annotations and the plan.
//
//   struct Gravity {
//       Vec3d g;
//       static NodeType declare()
//       {
//           return node<Gravity>("gravity", "Accelerates all points equally.")
//               .param(&Gravity::g, "g", Vec3d(0, -9.81, 0), any_number(), "m/s²", "acceleration");
//       }
//       ...
//   };
//   RAPID_NODE(Gravity);
//
// The struct has one of these member functions:
//
//   void edit(PointSet&, const Evaluation&)                  changes all points at once (one by one: point_edit.h)
//   void contribute(const Chunk&, Forces&) const             a force, called by Solve (solver/forces.h)
//   std::optional<Uniform> uniform() const                   a uniform force; may be given besides contribute()
//   auto dynamic(const Evaluation&) const                    a shared pointer to a Collider, Constraint, Action, Force,
//                                                            or Interaction
//   Flow evaluate(std::span<Flow>, const Evaluation&)        anything else (Create, Merge, Solve)
//
// and may have these:
//
//   bool add_potential(const Chunk&, std::span<double>) const    the potential energy of a conservative force
//   Flow start(std::span<Flow>, const Evaluation&)           the first frame, in which nodes between Create and Solve
//                                                            do not run; by default it passes on the first input
//   void uses(Uses&) const                                   attributes and groups that depend on the arguments
//   void check() const                                       arguments that are legal separately but not together
//
// Fields are set from the arguments before each evaluation. In uses() and check(), they hold those of the first frame.
// Other members are state that lasts for a run.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/node_type.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

// Turns a node's struct into an Operator, using its member functions (listed in node.h).

namespace detail {

// The force of a node whose struct has contribute() or uniform().
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

// The operator of a node whose struct has edit(), contribute(), uniform(), dynamic() or evaluate().
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

    T fields_{};
};

}  // namespace detail

// Builds a declaration. T::make() creates the operator if the node needs a special one. A struct with a member `group`
// has the parameter of that name.
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
            param(&T::group, "group", Value(), any_number(), "", "limits the node to the points of this group");
    }

    // Declares a parameter stored in `field`, which needs no initialiser and may belong to a shared base. fallback:
    // the default, in the user's unit; nil if the field can be empty. Degrees ("deg") are stored as radians.
    template <class F, class Base>
    Declaration& param(F Base::*field, std::string name, Value fallback, Range range, std::string unit, std::string doc)
    {
        F T::*const own = field;
        type_.params.push_back(
            param_of(own, std::move(name), std::move(fallback), range, std::move(unit), std::move(doc)));
        return *this;
    }

    // Accepts arguments of any other name: values of the attributes of that name.
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

    // Modify the parameter declared last.
    Declaration& required() { return last().required = true, *this; }
    Declaration& constant() { return last().of_the_frame = false, *this; }  // not a function of the frame
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
    Declaration& counted_as(std::string stem) { return type_.counted_as = std::move(stem), *this; }

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

// Registers a native type while the program starts; used through RAPID_NODE, in the file of the node.
struct NodeRegistration {
    explicit NodeRegistration(NodeType (*declare)());
};
#define RAPID_NODE(Type) \
    static const ::rapid::NodeRegistration registration_of_##Type([] { return NodeType(Type::declare()); })

}  // namespace rapid
