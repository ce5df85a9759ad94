#include "runtime/points/range.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>

#include "runtime/base/error.h"
#include "runtime/base/parallel.h"
#include "runtime/points/point_set.h"

namespace rapid {
namespace {

// The range as two floats, without infinity unless it is accepted.
struct Bounds {
    float lo, hi;

    explicit Bounds(const Range& range) : lo(static_cast<float>(range.lo)), hi(static_cast<float>(range.hi))
    {
        constexpr float huge = std::numeric_limits<float>::infinity();
        if (range.lo_excluded) lo = std::nextafter(lo, huge);
        if (range.infinity) return;
        lo = std::max(lo, std::numeric_limits<float>::lowest());
        hi = std::min(hi, std::numeric_limits<float>::max());
    }
    bool excludes(float x) const { return !(x >= lo) | !(x <= hi); }
};

[[noreturn]] void refuse(const PointSet& points, std::size_t i, const AttributeRange& given, float value,
                         std::int64_t frame)
{
    const std::string from =
        given.parameter == given.attribute ? "" : fmt::format(" (its attribute \"{}\")", given.attribute);
    throw Error(fmt::format("point {}, frame {}: {} = {:g}{} is out of range; it must be {}", points.id()[i], frame,
                            given.parameter, value, from, given.range.right()));
}

}  // namespace

std::string Range::text() const
{
    const bool low = std::isfinite(lo), high = std::isfinite(hi);
    if (low && high && !lo_excluded) return fmt::format("from {} to {}", lo, hi);
    if (low && high) return fmt::format("above {} and at most {}", lo, hi);
    if (low) return fmt::format("{} {}", lo_excluded ? "above" : "at least", lo);
    if (high) return fmt::format("at most {}", hi);
    return "any number";
}

std::string Range::right() const { return bounded() ? text() : "finite"; }

Range range_of_attribute(std::string_view name)
{
    if (name == "mass") return or_infinity(above(0));  // an infinite mass is immovable
    if (name == "pscale" || name == "airresist") return at_least(0);
    return name == "life" ? or_infinity(any_number()) : any_number();
}

void require_in_range(const PointSet& points, Strided<std::uint8_t> members, const AttributeRange& given,
                      std::int64_t frame)
{
    const auto* column = points.find<float>(given.attribute);
    if (!column || points.empty()) return;
    const Bounds bounds(given.range);
    const Strided<float> values = column->read();
    if (values.stride == 0 && !bounds.excludes(values[0])) return;

    std::atomic<std::size_t> first = points.size();
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        std::uint32_t excluded = values.stride == 0;  // a count, because a loop that sets a flag is not vectorised
        if (values.stride)
            for (std::size_t i = begin; i < end; ++i) excluded += bounds.excludes(values.data[i]);
        if (excluded == 0) return;
        for (std::size_t i = begin; i < end; ++i) {
            if (!members[i] || !bounds.excludes(values[i])) continue;
            for (std::size_t known = first; i < known && !first.compare_exchange_weak(known, i);) {
            }
            return;
        }
    });
    if (first < points.size()) refuse(points, first, given, values[first], frame);
}

}  // namespace rapid
