// The ages of newborn points at the end of the frame in which they are born.
//
// A point born within the frame's interval has an age L with 0 <= L <= h: h for birth = "begin", 0 for "end", uniform
// in between for "random", and h minus its exact time of birth for "even". With the parameter `age` it may be older.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "runtime/graph/param.h"
#include "runtime/operators/emit/birth_source.h"
#include "runtime/operators/emit/births.h"
#include "runtime/operators/emit/draws.h"
#include "runtime/operators/emit/interval.h"

namespace rapid {

// The parameter `age`: an interval, or a float attribute of the source.
struct BirthAge {
    static constexpr std::string_view param_type = "number, {min, max} or rapid.attr";
    Interval interval;
    std::string attribute;

    bool is_single() const { return attribute.empty() && interval.is_single(); }
    // Error: the source lacks the attribute, or one of its values is no age.
    void check(const BirthSource& source) const;
};

void read_value(const Param& param, const Value& value, BirthAge& field);

// The ages of one frame's births. What it is made from outlives it.
class BirthAges {
public:
    // frame_length: s; 0 in the initial state, which is not advanced.
    BirthAges(const std::optional<BirthAge>& age, const std::string& birth, const BirthSource& source,
              double frame_length);

    double frame_length() const { return h_; }
    // The age of all newborn, s; nothing where they differ.
    const std::optional<double>& common() const { return common_; }

    // The ages L of some births, s; places_in_frame: their numbers among the births of this frame; spans have shape
    // [n]. The draws are read where ages are random.
    void find(const Births& births, const Items& places_in_frame, std::span<const Birthplace> places,
              std::span<const Draws> draws, std::span<double> L) const;

private:
    const std::optional<BirthAge>& age_;
    const BirthSource& source_;
    const double h_;
    const bool even_;
    std::optional<double> common_;
};

}  // namespace rapid
