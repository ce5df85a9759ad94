// The checked mode of the evaluator: a node finds poison in every column and group that it has not declared, and must
// leave them as they are. A declaration that is too short shows at once, and not only in a scene that leaves out what
// the node needs. Gaffer checks the hashes of its nodes in the same way.
#pragma once

#include <map>
#include <span>
#include <string>

#include "runtime/graph/node.h"
#include "runtime/points/point_set.h"

namespace rapid {

class UndeclaredColumns {
public:
    // Takes away what none of `declared` names: NaN in columns of floats, an unlikely number in others. P, v, id and dt
    // stay, and all columns stay where the node may read everything.
    UndeclaredColumns(PointSet& points, std::span<const Uses> declared);

    // Puts the values back, by id; newborn points keep what they were given. `points`: what the node has made of them,
    // in the same order. Error: a column that was written, or poison that has found its way into a declared one.
    void restore(PointSet& points) const;

private:
    Column<std::int64_t> ids_;
    std::map<std::string, AnyColumn> columns_;
    std::map<std::string, Column<std::uint8_t>> groups_;
};

}  // namespace rapid
