// A function of a point, from the host of the scripting language, that edits points for a native node.
#pragma once

#include "runtime/graph/evaluation.h"

namespace rapid {

class PointEditor {
public:
    virtual ~PointEditor() = default;

    // Calls the function for the points from `first` on, in parallel, and removes those that it kills. Throws the
    // script's Error, with the point.
    virtual void edit(PointSet& points, std::size_t first, const Evaluation& now) const = 0;
};

}  // namespace rapid
