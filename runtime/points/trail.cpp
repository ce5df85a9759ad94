#include "runtime/points/trail.h"

#include <algorithm>

namespace rapid {

std::string trail_name(int place) { return "trail" + std::to_string(place); }

std::vector<AttributeSpec> trail_columns(int places)
{
    std::vector<AttributeSpec> columns = {{trail_count_name, std::int32_t{0}}};
    for (int place = 1; place <= places; ++place) columns.push_back({trail_name(place), Vec3f(0, 0, 0)});
    return columns;
}

Trails::Trails(const PointSet& points) : P_(points.P().read()), count_(points.find<std::int32_t>(trail_count_name))
{
    if (!count_) return;
    while (places() < max_trail_places) {
        const auto* column = points.find<Vec3f>(trail_name(places() + 1));
        if (!column) return;
        columns_.push_back(column->read());
    }
}

int Trails::count(std::size_t i) const { return count_ ? std::clamp((*count_)[i], 0, places()) : 0; }

}  // namespace rapid
