// The checked mode of the evaluator: a node finds poison in every column and group that it has not declared, and must
// leave them unchanged. An incomplete declaration then shows immediately, not only in a scene that prunes a column
// that the node needs. Gaffer checks the hashes of its nodes in the same way.
#pragma once

#include <map>
#include <span>
#include <string>

#include "runtime/graph/node.h"
#include "runtime/points/point_set.h"

namespace rapid {

class UndeclaredColumns {
public:
    // Replaces everything that `declared` does not name: with NaN in float columns, with an unlikely number in others.
    // P, v, id and dt stay, and all columns stay if the node may read everything.
    UndeclaredColumns(PointSet& points, std::span<const Uses> declared);

    // Restores the values by id; newborn points keep the values that they were given. `points`: the node's result, in
    // the same order. Throws Error if a column was written, or if poison reached a declared one.
    void restore(PointSet& points) const;

private:
    Column<std::int64_t> ids_;
    std::map<std::string, AnyColumn> columns_;
    std::map<std::string, Column<std::uint8_t>> groups_;
};

}  // namespace rapid
