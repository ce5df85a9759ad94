// Sources of error of positions that no estimate includes, found from the plan before the first frame.
//
// The shadows of Solve (solver/estimate/shadow.h) measure what more substeps would change. Whatever else affects where
// a point is, is listed here, unless its error is known to be 0:
//
//   graph    what is evaluated once per frame: nodes that change points, functions of the frame, paths of emitters
//   shapes   level sets and grids, and the tracks of moving shapes, also of those that only a kernel reaches
//
// A node that changes points is listed if it writes an attribute or a group on which motion depends. A type for which
// this is wrong declares its own text in its file:
//
//   RAPID_GRAPH_ERROR("spawn", Spawn, "whose births inherit the errors of their parents");
//
// A mesh is taken to be the shape itself: its tessellation is no error.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/plan.h"

namespace rapid {

// A node, or one of its parameters, and why its error is not estimated: "swirl, which changes v once per frame".
struct UnmeasuredError {
    enum Source { Graph, Shapes };

    Source source = Graph;
    std::string text;
};

struct ErrorSources {
    std::vector<UnmeasuredError> unmeasured;  // in the order of the plan
    // Solve has one closed form for all motion, so that it has no error: uniform accelerations and linear drag, without
    // colliders, constraints and actions.
    bool is_closed_form = false;

    std::vector<std::string> texts_of(UnmeasuredError::Source source) const;
};

// The texts contain the voxel sizes and the number of evaluations per frame on which the errors depend.
ErrorSources error_sources_of(const Plan& plan);

// Declares the error of nodes of a type that changes points. text: empty if the error is 0, apart from that of the
// node's arguments.
struct GraphErrorRegistration {
    GraphErrorRegistration(std::string_view type, std::string_view text);
};

#define RAPID_GRAPH_ERROR(type, Type, text) \
    static const ::rapid::GraphErrorRegistration graph_error_of_##Type(type, text)

}  // namespace rapid
