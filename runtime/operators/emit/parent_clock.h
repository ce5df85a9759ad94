// How many points each parent bears in a step, and when.
//
// A parent's births are numbered from 0 over its life. What is due of a birth at the end of a step is carried over to
// the next, parent by parent.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/evaluation.h"
#include "runtime/operators/emit/amount.h"
#include "runtime/operators/emit/birth_event.h"
#include "runtime/operators/emit/parent_paths.h"
#include "runtime/points/state_archive.h"
#include "runtime/points/state_checks.h"
#include "runtime/random.h"

namespace rapid {

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
    int part = 0, parts = 1;      // of a frame: the step\'s number in it, from 0, and how many there are
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
