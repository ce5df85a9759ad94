// What couples points: makes what becomes of one depend on which others there are. Of points that nothing couples a
// subset can be simulated alone (points/subset.h), to the same bits.
//
// Known for each type of node. What edits points one by one, and a force, an action or a collider, acts on each point
// alone; constraints and functions of the whole set never do. Any other native node that changes points says what it
// couples, in its own file:
//
//   std::string couples(const Plan& plan, const PlannedNode& node) const;    empty: nothing
//   RAPID_COUPLING("emit", Emit);
//
// One that brings points also has take(const Subset&), and leaves the others out, whose ids and random numbers stay
// theirs.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/plan.h"
#include "runtime/points/subset.h"

namespace rapid {

struct PointCoupling {
    NodePtr node;
    std::string what;  // "acts between neighbours"
};

// Of the nodes that are reached, in the order of the plan.
std::vector<PointCoupling> couplings_of(const Plan& plan);
// Error: points are coupled; of the first node that does it, with its place.
void refuse_coupled(const Plan& plan);
// From now on the nodes that bring points bring those of the subset alone; before the plan is evaluated. Error: as
// refuse_coupled().
void take_subset(const Plan& plan, const Subset& subset);

// The value of a float attribute that all points of a simulation have from their birth to their end; nothing where they
// may differ.
std::optional<float> value_of_all(const Plan& plan, std::size_t simulation, const std::string& attribute);

// What a type of node says of itself.
struct CouplingRule {
    std::string_view type;
    std::string (*couples)(const Plan& plan, const PlannedNode& node);
    // Of nodes that bring points: the values of this attribute that these get, none where there are no points; nothing
    // where they are many. The fallback is that of points without one of their own. Null: brings none.
    std::optional<std::vector<float>> (*values)(const PlannedNode& node, const std::string& attribute, float fallback);
    // Of these: takes a subset. Null: brings none.
    void (*take)(const PlannedNode& node, const Subset& subset);
};

struct CouplingRegistration {
    explicit CouplingRegistration(CouplingRule rule);
};

template <class T>
CouplingRule coupling_rule(std::string_view type)
{
    CouplingRule rule{type,
                      [](const Plan& plan, const PlannedNode& node) -> std::string {
                          const T& fields = *static_cast<const T*>(node.op->fields());
                          if constexpr (requires { fields.couples(plan, node); })
                              return fields.couples(plan, node);
                          else
                              return {};
                      },
                      nullptr, nullptr};
    if constexpr (requires(const T& fields) { fields.values(std::string(), 0.0f); })
        rule.values = [](const PlannedNode& node, const std::string& attribute, float fallback) {
            return static_cast<const T*>(node.op->fields())->values(attribute, fallback);
        };
    if constexpr (requires(T & fields, const Subset& subset) { fields.take(subset); })
        rule.take = [](const PlannedNode& node, const Subset& subset) {
            static_cast<T*>(node.op->fields())->take(subset);
        };
    return rule;
}

// A type whose struct has no couples() couples nothing.
#define RAPID_COUPLING(type, Type) \
    static const ::rapid::CouplingRegistration coupling_of_##Type(::rapid::coupling_rule<Type>(type))

}  // namespace rapid
