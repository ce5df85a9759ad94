// Coupling: a node couples points if the result of one depends on which others exist. If nothing couples the points, a
// subset can be simulated alone (points/subset.h), with bit-identical results.
//
// This is known for each type of node. Point-by-point edits, forces, actions and colliders act on each point alone.
// Constraints and functions of the whole set never do. Any other native node that changes points declares its coupling
// in its own file:
//
//   std::string couples(const Plan& plan, const PlannedNode& node) const;    empty: nothing
//   RAPID_COUPLING("emit", Emit);
//
// A node that adds points also has take(const Subset&), and skips the other points, whose ids and random numbers stay
// reserved.
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

// Returns the couplings of reached nodes, in the order of the plan.
std::vector<PointCoupling> couplings_of(const Plan& plan);
// Throws Error if points are coupled, with the location of the first node that couples them.
void refuse_coupled(const Plan& plan);
// Makes nodes add only the points of the subset. Must be called before the plan is evaluated. Throws Error as
// refuse_coupled() does.
void take_subset(const Plan& plan, const Subset& subset);

// Returns the value of a float attribute that all points of a simulation have throughout their lives; nothing if they
// may differ.
std::optional<float> value_of_all(const Plan& plan, std::size_t simulation, const std::string& attribute);

// Declaration of a node type.
struct CouplingRule {
    std::string_view type;
    std::string (*couples)(const Plan& plan, const PlannedNode& node);
    // For nodes that add points: the values of this attribute for these points. Empty if there are no points, nothing
    // if the values are many. fallback: the value of points without one of their own. Null if the node adds no points.
    std::optional<std::vector<float>> (*values)(const PlannedNode& node, const std::string& attribute, float fallback);
    // For the same nodes: selects a subset. Null if the node adds no points.
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

// Registers the coupling of a type. A struct without couples() couples nothing.
#define RAPID_COUPLING(type, Type) \
    static const ::rapid::CouplingRegistration coupling_of_##Type(::rapid::coupling_rule<Type>(type))

}  // namespace rapid
