// The children born from the points of a node in one step: column by column, in parallel.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "runtime/graph/evaluation.h"
#include "runtime/graph/param.h"
#include "runtime/graph/point_function.h"
#include "runtime/math/random.h"
#include "runtime/operators/births/newborn.h"
#include "runtime/operators/spawn/parent_paths.h"
#include "runtime/points/state_archive.h"

namespace rapid {

// The number of points that each parent emits in a step, and their times.
//
// A parent's births are numbered from 0 over its life. The fraction of a birth due at the end of a step carries over
// to the next step, separately for each parent.

// Births per second (double), or a number of births (int): a constant, or an attribute of the parents.
template <class T>
struct Amount {
    static constexpr std::string_view param_type =
        std::is_same_v<T, int> ? "integer or rapid.attr" : "number or rapid.attr";
    T value{};
    std::string attribute;  // if not empty, each parent has its own value
};

template <class T>
void read_value(const Param& param, const Value& value, Amount<T>& field)
{
    field = {};
    if (const auto* reference = value.get<AttributeRef>())
        field.attribute = reference->name;
    else
        read_value(param, value, field.value);
}

// "age > 0.5", "P.y < 0": an event at the time when it becomes true.
struct AttributeComparison {
    enum Relation { Below, AtMost, Above, AtLeast };
    std::string attribute;
    int axis = -1;  // of a vec3; -1 for a number
    Relation relation = Above;
    double limit = 0;

    bool holds(double value) const
    {
        switch (relation) {
            case Below:
                return value < limit;
            case AtMost:
                return value <= limit;
            case Above:
                return value > limit;
            case AtLeast:
                break;
        }
        return value >= limit;
    }
};

// The event at which a parent emits children: the parameter `on`.
struct BirthEvent {
    // The host of the scripting language compiles functions to kernels; it detects them by the end of this string.
    static constexpr std::string_view param_type = "event or function of a point";

    enum Kind { Hit, Death, Birth, Compares, Tests };
    Kind kind = Hit;
    AttributeComparison comparison;
    std::shared_ptr<const PointFunction> test;

    // Adds the attributes that it reads from the parents.
    void uses(Uses& uses) const;
};

void read_value(const Param& param, const Value& value, BirthEvent& field);

// The children of one parent: born at one time, or over the parent's time in the step.
struct Children {
    static constexpr std::uint32_t no_hit = UINT32_MAX;

    std::uint32_t parent;         // index among the paths
    std::uint32_t hit = no_hit;   // index in the record of the hit at which they are born
    std::uint64_t number;         // of the first among all births of the parent
    std::size_t first, count;     // index of the first among all births of the step; their number
    double begin, end;            // s since the beginning of the step; equal for a single time
    double spacing = 0, due = 0;  // even births: birth i at begin + (i + 1 - due) spacing
};

struct BirthPlan {
    std::optional<Amount<double>> rate;  // 1/s, per parent
    std::optional<Amount<int>> count;    // per frame or event, and per parent
    std::optional<BirthEvent> on;
    double min_speed = 0;         // m/s, of hits
    std::optional<double> limit;  // births per parent
    std::string birth;            // "random", "begin", "end", "even": within a parent's time in the step
    int part = 0, parts = 1;      // the step's number in its frame, from 0, and the steps per frame
};

class ParentClock {
public:
    // Returns the children of a step, by parent, then by time. Must be called for the steps in order.
    std::vector<Children> births(const ParentPaths& parents, const BirthPlan& plan, const Evaluation& now);

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(ids_, states_);
        if constexpr (Archive::is_loading::value) StateReader::expect(states_.size() == ids_.size());
    }

private:
    struct State {
        double due = 0;          // fraction of a birth, in [0, 1)
        std::uint64_t born = 0;  // births so far
        bool is_known = false;   // it has emitted in an earlier step, so `due` is valid
        bool held = false;       // the comparison or test was true at the end of the last step

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(due, born, is_known, held);
            if constexpr (Archive::is_loading::value) StateReader::expect(is_between(due, 0, 1));
        }
    };
    class Tally;

    // For living points, in the order of the last step.
    Column<std::int64_t> ids_;
    std::vector<State> states_;
};

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
