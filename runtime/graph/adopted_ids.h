// The ids of points of one simulation in another, which has adopted them by a merge.
//
// A point keeps its adopted id in every later frame and through every merge. Points are born in runs of consecutive
// ids, so the table holds runs: a few words per frame, not eight bytes per point.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace rapid {

class AdoptedIds {
public:
    // The adopted id of the point `id` of the other simulation. A new point takes `next`, the next free id here.
    std::int64_t of(std::int64_t id, std::int64_t& next)
    {
        if (last_ < runs_.size() && runs_[last_].holds(id)) return runs_[last_].of(id);
        const auto after = std::upper_bound(runs_.begin(), runs_.end(), id,
                                            [](std::int64_t wanted, const Run& run) { return wanted < run.first; });
        if (after != runs_.begin()) {
            Run& before = *(after - 1);
            last_ = static_cast<std::size_t>(after - runs_.begin()) - 1;
            if (before.holds(id)) return before.of(id);
            if (id == before.first + before.size && next == before.adopted + before.size) {
                ++before.size;
                return next++;
            }
        }
        last_ = static_cast<std::size_t>(runs_.insert(after, Run{id, 1, next}) - runs_.begin());
        return next++;
    }

    std::size_t runs() const { return runs_.size(); }

private:
    struct Run {
        std::int64_t first, size;  // in the other simulation
        std::int64_t adopted;      // id here of the first

        bool holds(std::int64_t id) const { return id >= first && id < first + size; }
        std::int64_t of(std::int64_t id) const { return adopted + (id - first); }
    };

    std::vector<Run> runs_;  // in order of `first`
    std::size_t last_ = 0;   // run of the last query, which mostly holds the next one too
};

}  // namespace rapid
