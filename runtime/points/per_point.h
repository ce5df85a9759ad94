// A parameter with one value for all points, or with a value per point from an attribute.
#pragma once

#include <optional>
#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

template <class T>
struct PerPoint {
    T constant = Column<T>::zero();
    std::string attribute;  // if not empty, the values come from this column

    PerPoint() = default;
    PerPoint(T value) : constant(value) {}
    static PerPoint of(std::string attribute)
    {
        PerPoint result;
        result.attribute = std::move(attribute);
        return result;
    }

    // Returns the values. Valid while this parameter and the set's column stay unchanged. Throws Error if the attribute
    // does not exist or has another type.
    Strided<T> read(const PointSet& points) const
    {
        if (attribute.empty()) return {&constant, 0};
        return points.column<T>(attribute).read();
    }
};

// Returns the masses of points, kg: the attribute mass if it exists, otherwise 1. Valid while that column stays
// unchanged.
inline Strided<float> masses_of(const PointSet& points)
{
    static constexpr float unit = 1;
    const auto* masses = points.find<float>("mass");
    return masses ? masses->read() : Strided<float>{&unit, 0};
}

// Returns the radii of points, m: those given, else the attribute pscale if it exists, else 0. Valid as long as
// PerPoint::read().
inline Strided<float> radii_of(const std::optional<PerPoint<float>>& given, const PointSet& points)
{
    static constexpr float none = 0;
    if (given) return given->read(points);
    if (points.has("pscale")) return points.column<float>("pscale").read();
    return {&none, 0};
}

}  // namespace rapid
