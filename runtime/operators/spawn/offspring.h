// The children born from the points of a node in one step: column by column, in parallel.
#pragma once

#include <string>
#include <vector>

#include "runtime/graph/evaluation.h"
#include "runtime/operators/births/newborn.h"
#include "runtime/operators/spawn/parent_clock.h"
#include "runtime/operators/spawn/parent_paths.h"

namespace rapid {

// Settings for newborn points, and their inheritance from parents.
struct Traits {
    const Newborn& newborn;
    std::vector<std::string> inherit;  // attributes copied from the parents
    double share;                      // fraction of the parent's velocity
    bool splits;
    double wait;  // s from the end of the parents' step to the end of the frame
};

class Offspring {
public:
    // All arguments must outlive it.
    Offspring(const ParentPaths& parents, const std::vector<Children>& all_children, const Traits& traits,
              const Evaluation& now);

    // Appends the first `most` births, or all if there are fewer, with ids from next_id on. Returns their number.
    std::size_t append_to(PointSet& points, std::int64_t& next_id, std::size_t most) const;

    // Creates the columns that newborn points need, even if there are no births.
    void make_columns(PointSet& points) const;

private:
    struct Columns;

    Columns columns_of(PointSet& points, std::size_t n) const;
    void add_inherited(PointSet& points, std::size_t n, Columns& columns) const;
    void fill(const Columns& columns, std::size_t begin, std::size_t end) const;
    double speed_of(std::uint64_t number) const;
    ParentPaths::Moment moment_of_hit(std::uint32_t index) const;
    Vec3d normal_of(const Children& children, const Vec3d& v) const;

    const ParentPaths& parents_;
    const std::vector<Children>& all_children_;
    const Traits& traits_;
    const Newborn& newborn_;
    const Evaluation& now_;
};

}  // namespace rapid
