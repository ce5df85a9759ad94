// The legal values of a parameter, or of an attribute that supplies one.
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
    bool lo_excluded = false;  // lo itself is out of range
    bool infinity = false;     // accepts math.huge too; NaN is never accepted

    bool contains(double x) const { return (lo_excluded ? x > lo : x >= lo) && x <= hi; }
    bool accepts(double x) const { return contains(x) && (std::isfinite(x) || infinity); }
    bool bounded() const { return std::isfinite(lo) || std::isfinite(hi); }
    std::string text() const;   // "from 0 to 1", "at least 0", "above 0"
    std::string right() const;  // the legal values: text(), or "finite"
};

inline Range any_number() { return {}; }
inline Range at_least(double lo) { return {lo}; }
inline Range above(double lo) { return {lo, std::numeric_limits<double>::infinity(), true}; }
inline Range between(double lo, double hi) { return {lo, hi}; }
inline Range or_infinity(Range range) { return range.infinity = true, range; }

// Returns the range of a known attribute for every reader: mass is above 0, pscale at least 0.
Range range_of_attribute(std::string_view name);

// A float attribute that a node reads, directly or for a parameter, and its legal values.
struct AttributeRange {
    std::string parameter, attribute;
    Range range;
};

// Throws Error if a member's value is out of range; the message has the parameter and the id of the first such point.
// Does nothing if the points lack the attribute. frame: for the message.
void require_in_range(const PointSet& points, Strided<std::uint8_t> members, const AttributeRange& given,
                      std::int64_t frame);

}  // namespace rapid
