// Points with trails for the tests of formats that hold lines.
#pragma once

#include "runtime/points/trail.h"
#include "tests/io/random_points.h"

namespace rapid::test {

// Point i has i % 4 earlier positions, each a metre above the one after it.
inline PointSet points_with_trails(std::size_t size)
{
    PointSet points = random_points({.size = size, .wide = false, .strings = false});
    for (const AttributeSpec& column : trail_columns(3)) points.add(column);
    const std::span<std::int32_t> count = points.column<std::int32_t>(trail_count_name).write();
    for (std::size_t i = 0; i < size; ++i) count[i] = static_cast<std::int32_t>(i % 4);
    for (int place = 1; place <= 3; ++place) {
        const std::span<Vec3f> P = points.column<Vec3f>(trail_name(place)).write();
        for (std::size_t i = 0; i < size; ++i) P[i] = points.P()[i] + Vec3f(0, static_cast<float>(place), 0);
    }
    return points;
}

}  // namespace rapid::test
