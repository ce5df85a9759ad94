// The points that are born from the points of a node in one step: column by column, in parallel.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/evaluation.h"
#include "runtime/operators/emit/birth_values.h"
#include "runtime/operators/emit/interval.h"
#include "runtime/operators/emit/parent_clock.h"
#include "runtime/operators/emit/parent_paths.h"

namespace rapid {

// What newborn points get, and what of it is their parents'.
struct Traits {
    Vec3d velocity;
    Interval speed;                // m/s
    double spread = 0, share = 1;  // rad, part of the parent's velocity
    std::optional<Interval> life;
    BirthValues attributes;
    std::vector<std::string> inherit;
    std::string group;
    bool splits = false;
    double wait = 0;  // s from the end of the parents' step to the end of the frame

    // The attributes that newborn points get from their parents.
    std::vector<std::string> of_parents() const;
};

class Offspring {
public:
    // All outlive it.
    Offspring(const ParentPaths& parents, const std::vector<Brood>& broods, const Traits& traits,
              const Evaluation& now);

    // Appends the first n births, or all, with ids from next_id on. Returns how many.
    std::size_t append_to(PointSet& points, std::int64_t& next_id, std::size_t most) const;

    // The columns that newborn points need, whether there are any or not.
    void make_columns(PointSet& points) const;

private:
    struct Columns;

    Columns columns_of(PointSet& points, std::size_t n) const;
    void add_drawn(PointSet& points, std::size_t n, Columns& columns) const;
    void add_inherited(PointSet& points, std::size_t n, Columns& columns) const;
    void fill(const Columns& columns, std::size_t begin, std::size_t end) const;
    double speed_of(std::uint64_t number) const;
    ParentPaths::Moment moment_of_hit(std::uint32_t place) const;
    Vec3d normal_of(const Brood& brood, const Vec3d& v) const;

    const ParentPaths& parents_;
    const std::vector<Brood>& broods_;
    const Traits& traits_;
    const Evaluation& now_;
};

}  // namespace rapid
