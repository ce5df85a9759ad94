// How many points each parent bears in a step, and when.
//
// A parent's births are numbered from 0 over its life. What is due of a birth at the end of a step is carried over to
// the next, parent by parent.
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
#include "runtime/operators/spawn/parent_paths.h"
#include "runtime/points/state_archive.h"
#include "runtime/points/state_checks.h"
#include "runtime/random.h"

namespace rapid {

// Births a second (double), or whole births (int): a number, or an attribute of the parents.
template <class T>
struct Amount {
    static constexpr std::string_view param_type =
        std::is_same_v<T, int> ? "integer or rapid.attr" : "number or rapid.attr";
    T value{};
    std::string attribute;  // where not empty, each parent has its own
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

// "age > 0.5", "P.y < 0": true from a moment on.
struct AttributeComparison {
    enum Relation { Below, AtMost, Above, AtLeast };
    std::string attribute;
    int axis = -1;  // of a vec3; -1 of a number
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

// The moment at which a parent bears others: the parameter `on`.
struct BirthEvent {
    // Functions are made kernels by the host of the scripting language, as the end of this says.
    static constexpr std::string_view param_type = "event or function of a point";

    enum Kind { Hit, Death, Birth, Compares, Tests };
    Kind kind = Hit;
    AttributeComparison comparison;
    std::shared_ptr<const PointFunction> test;

    // What it reads of its points.
    void uses(Uses& uses) const;
};

void read_value(const Param& param, const Value& value, BirthEvent& field);

// Births of one parent: at one moment, or over its time in the step.
struct Brood {
    static constexpr std::uint32_t no_hit = UINT32_MAX;

    std::uint32_t parent;         // among the paths
    std::uint32_t hit = no_hit;   // of the record, that they are born at
    std::uint64_t number;         // of the first among all births of the parent
    std::size_t first, count;     // of the first among all births of the step; how many
    double begin, end;            // s since the beginning of the step; equal for one moment
    double spacing = 0, due = 0;  // even births: birth i at begin + (i + 1 - due) spacing
};

struct BirthPlan {
    std::optional<Amount<double>> rate;  // 1/s, of each parent
    std::optional<Amount<int>> count;    // a frame, or an event, of each parent
    std::optional<BirthEvent> on;
    double min_speed = 0;         // m/s, of hits
    std::optional<double> limit;  // births of a parent
    std::string birth;            // "random", "begin", "end", "even": over the time of a parent in the step
    int part = 0, parts = 1;      // of a frame: the step's number in it, from 0, and how many there are
};

class ParentClock {
public:
    // The broods of a step, in the order of the parents, then of time. Called for the steps in their order.
    std::vector<Brood> births(const ParentPaths& parents, const BirthPlan& plan, const Evaluation& now);

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(ids_, states_);
        if constexpr (Archive::is_loading::value) StateReader::expect(states_.size() == ids_.size());
    }

private:
    struct State {
        double due = 0;          // of a birth, in [0, 1)
        std::uint64_t born = 0;  // births so far
        bool is_known = false;   // whether it has borne in a step before, so that `due` counts
        bool held = false;       // whether the comparison, or the test, was true at the end of the last step

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(due, born, is_known, held);
            if constexpr (Archive::is_loading::value) StateReader::expect(is_between(due, 0, 1));
        }
    };
    class Tally;

    // Of the living, in the order of the last step.
    Column<std::int64_t> ids_;
    std::vector<State> states_;
};

}  // namespace rapid
