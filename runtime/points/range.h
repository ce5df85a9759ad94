// The numbers that a parameter, or an attribute that stands for one, may be.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "runtime/points/column.h"

namespace rapid {

class PointSet;

struct Range {
    double lo = -std::numeric_limits<double>::infinity();
    double hi = std::numeric_limits<double>::infinity();
    bool lo_excluded = false;  // above lo, not at it
    bool infinity = false;     // accepts math.huge too; NaN is never in range

    bool contains(double x) const { return (lo_excluded ? x > lo : x >= lo) && x <= hi; }
    bool accepts(double x) const { return contains(x) && (std::isfinite(x) || infinity); }
    bool bounded() const { return std::isfinite(lo) || std::isfinite(hi); }
    std::string text() const;   // "from 0 to 1", "at least 0", "above 0"
    std::string right() const;  // what a refused value must be: the text, or "finite"
};

inline Range any_number() { return {}; }
inline Range at_least(double lo) { return {lo}; }
inline Range above(double lo) { return {lo, std::numeric_limits<double>::infinity(), true}; }
inline Range between(double lo, double hi) { return {lo, hi}; }
inline Range or_infinity(Range range) { return range.infinity = true, range; }

// What a known attribute may be, whoever reads it: mass is above 0, pscale at least 0.
Range range_of_attribute(std::string_view name);

// An attribute of floats that a node reads, by itself or for a parameter, and what its values may be.
struct AttributeRange {
    std::string parameter, attribute;
    Range range;
};

// Error: a value is out of range, with the parameter and the point's id; of several points the first. An attribute that
// the points do not have is none. members: the points that are asked about; frame: for the message.
void require_in_range(const PointSet& points, Strided<std::uint8_t> members, const AttributeRange& given,
                      std::int64_t frame);

}  // namespace rapid
