// A parameter that is one number for all points, or an attribute that gives each point its own.
#pragma once

#include <optional>
#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

template <class T>
struct PerPoint {
    T constant = Column<T>::zero();
    std::string attribute;  // where not empty, read from this column instead

    PerPoint() = default;
    PerPoint(T value) : constant(value) {}
    static PerPoint of(std::string attribute)
    {
        PerPoint result;
        result.attribute = std::move(attribute);
        return result;
    }

    // Valid while this parameter and the set's column stay as they are. Error: no such attribute, or of another type.
    Strided<T> read(const PointSet& points) const
    {
        if (attribute.empty()) return {&constant, 0};
        return points.column<T>(attribute).read();
    }
};

// The masses of points, kg: the attribute mass where the points have it, else 1. Valid while that column stays.
inline Strided<float> masses_of(const PointSet& points)
{
    static constexpr float unit = 1;
    const auto* masses = points.find<float>("mass");
    return masses ? masses->read() : Strided<float>{&unit, 0};
}

// The radii of points, m: those given, else the attribute pscale where the points have it, else 0. Valid as
// PerPoint::read() is.
inline Strided<float> radii_of(const std::optional<PerPoint<float>>& given, const PointSet& points)
{
    static constexpr float none = 0;
    if (given) return given->read(points);
    if (points.has("pscale")) return points.column<float>("pscale").read();
    return {&none, 0};
}

}  // namespace rapid
