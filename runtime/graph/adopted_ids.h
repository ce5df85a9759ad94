// The ids that points of one simulation have in another, where a merge takes them in.
//
// A point keeps the id that it was given when it was first seen, in every later frame and through every merge. Points
// are born and seen in runs of neighbouring ids, so the table holds runs: a few words a frame, not eight bytes a point.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace rapid {

class AdoptedIds {
public:
    // The id here of the point `id` there. `next` is the next free id here; one that is seen first takes it.
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
        std::int64_t first, size;  // there
        std::int64_t adopted;      // here, of the first

        bool holds(std::int64_t id) const { return id >= first && id < first + size; }
        std::int64_t of(std::int64_t id) const { return adopted + (id - first); }
    };

    std::vector<Run> runs_;  // in order of `first`
    std::size_t last_ = 0;   // where the last question was answered: the next one is mostly beside it
};

}  // namespace rapid
