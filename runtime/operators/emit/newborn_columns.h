// Where an emitter puts what it computes of newborn points.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "runtime/operators/emit/birth_values.h"
#include "runtime/parallel.h"
#include "runtime/points/column.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

// The newborn points' part of the columns in which each has a value of its own, shape [n]; the others are empty.
struct NewbornColumns {
    std::span<Vec3f> P, v;
    std::span<std::int64_t> id;
    std::span<float> dt, age, birthtime, life;
    // Copy inherited attributes to the newborn from number `first` on.
    std::vector<std::function<void(std::size_t first, std::span<const Birthplace> places)>> inherit;
    // Draw those that differ from birth to birth.
    std::vector<DrawValues> draw;
};

// The values of all points, one each; expanded in parallel, because they are many more than the newborn.
inline std::span<float> expanded(Column<float>& column)
{
    if (!column.is_uniform()) return column.write();
    const float shared = column[0];
    const std::span<float> values = column.overwrite();
    for_each_chunk(values.size(), [&](std::size_t begin, std::size_t end) {
        std::fill(values.begin() + static_cast<std::ptrdiff_t>(begin),
                  values.begin() + static_cast<std::ptrdiff_t>(end), shared);
    });
    return values;
}

}  // namespace rapid
