// The number of points that an emitter emits in a frame, and their times.
//
// By the time t = n / fps a constant rate r has emitted floor(r t) points, computed from the integer n of frames and
// never from a sum of steps. No birth is lost or duplicated at the end of a frame, however long the run. When the rate
// changes, the fraction of a birth that is due carries over. A birth at the end of a frame belongs to that frame.
//
// A point born within the frame's interval has an age L with 0 <= L <= h at its end: h for birth = "begin", 0 for
// "end", uniform in between for "random", and h minus its exact time of birth for "even". With the parameter `age` it
// may be older.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/param.h"
#include "runtime/math/items.h"
#include "runtime/operators/births/draws.h"
#include "runtime/operators/births/newborn.h"
#include "runtime/operators/emit/birth_source.h"
#include "runtime/points/state_archive.h"
#include "runtime/points/subset.h"

namespace rapid {

// Returns the number of births at a frame. impulse: numbers of births by frame.
template <class Numbers>
std::size_t impulse_at(const Numbers& impulse, std::int64_t frame)
{
    const auto found = impulse.find(frame);
    return found == impulse.end() ? 0 : static_cast<std::size_t>(found->second);
}

// Returns true if any frame up to this one has an impulse: a trial skips frames (Evaluator::examine).
template <class Numbers>
bool has_impulse_by(const Numbers& impulse, double frame)
{
    return !impulse.empty() && static_cast<double>(impulse.begin()->first) <= frame;
}

// The births of one frame, or of part of it, numbered from 0 over the emitter's whole life.
struct Births {
    std::uint64_t first = 0;
    std::size_t count = 0;

    // Evenly spaced births: birth i of this frame, from 0, takes place when i + 1 births are due.
    double due = 0;         // births due from the frame's beginning to its end; not an integer
    double per_second = 0;  // rate, 1/s
    // Returns the time from birth i to the frame's end, s, at least 0.
    double even_age(std::size_t i) const;
};

class BirthClock {
public:
    // No births occur before the end of the frame `start`.
    explicit BirthClock(std::int64_t start = 1) : anchor_(start) {}

    // Returns the births of `frame` at `rate` (1/s, finite, at least 0). Must be called for the frames in order.
    Births at_rate(double rate, std::int64_t frame, double fps);
    // Returns the share of a frame's `count` births in its part number `part`, from 0, of `parts`.
    Births at_once(std::size_t count, double fps, int part = 0, int parts = 1);

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(total_, rate_, anchor_, carry_, born_);
        if constexpr (Archive::is_loading::value)
            StateReader::expect(total_ <= max_births && born_ <= total_ && rate_ >= 0 && std::isfinite(rate_) &&
                                std::isfinite(carry_) && std::abs(anchor_) <= max_births);
    }

private:
    static constexpr std::int64_t max_births = std::int64_t{1} << 53;  // also the limit of frames

    double due_by(std::int64_t frame, double fps) const;

    std::uint64_t total_ = 0;  // births so far
    double rate_ = 0;          // 1/s
    std::int64_t anchor_;      // frame at the end of which this rate began
    double carry_ = 0;         // fraction of a birth due at the anchor, in [0, 1)
    std::uint64_t born_ = 0;   // births since the anchor
};

// The births of a frame, or the part of them that belongs to a subset.
struct Chosen {
    const Births& births;
    std::vector<std::uint32_t> indices;  // indices in the frame of those that belong to the subset
    bool are_all;

    std::size_t size() const { return are_all ? births.count : indices.size(); }
    // Return the chosen births from index `first` on, numbered within the frame, and within the emitter.
    Items in_frame(std::size_t first) const { return items(0, first); }
    Items numbers(std::size_t first) const { return items(births.first, first); }

private:
    Items items(std::uint64_t base, std::size_t first) const
    {
        return are_all ? Items(base + first) : Items(base, indices.data() + first);
    }
};

// Chooses the births of a subset. next_id: id of the first birth.
inline Chosen choose(const Births& births, const Subset& subset, std::int64_t next_id)
{
    Chosen chosen{births, {}, subset.is_all()};
    if (chosen.are_all) return chosen;
    for (std::size_t i = 0; i < births.count; ++i)
        if (subset.has(next_id + static_cast<std::int64_t>(i))) chosen.indices.push_back(static_cast<std::uint32_t>(i));
    return chosen;
}

// The parameter `age`: an interval, or a float attribute of the source.
struct BirthAge {
    static constexpr std::string_view param_type = "number, {min, max} or rapid.attr";
    Interval interval;
    std::string attribute;

    bool is_single() const { return attribute.empty() && interval.is_single(); }
    // Throws Error if the source lacks the attribute, or one of its values is not an age.
    void check(const BirthSource& source) const;
};

void read_value(const Param& param, const Value& value, BirthAge& field);

// The ages of one frame's births. The constructor's arguments must outlive it.
class BirthAges {
public:
    // frame_length: s; 0 in the initial state, which is not advanced.
    BirthAges(const std::optional<BirthAge>& age, const std::string& birth, const BirthSource& source,
              double frame_length);

    double frame_length() const { return h_; }
    // The age of all newborn points, s; empty if they differ.
    const std::optional<double>& common() const { return common_; }

    // Finds the ages L of some births, s. indices_in_frame: their numbers among the births of this frame; spans have
    // shape [n]. The draws are read only if ages are random.
    void find(const Births& births, const Items& indices_in_frame, std::span<const Birthplace> birthplaces,
              std::span<const Draws> draws, std::span<double> L) const;

private:
    const std::optional<BirthAge>& age_;
    const BirthSource& source_;
    const double h_;
    const bool even_;
    std::optional<double> common_;
};

}  // namespace rapid
