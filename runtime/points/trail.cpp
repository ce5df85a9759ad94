#include "runtime/points/trail.h"

#include <algorithm>
#include <numeric>

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

namespace {

PointLines lines_of_trails(const PointSet& points, const Trails& trails)
{
    PointLines lines;
    std::vector<std::uint32_t> sources(points.size());
    std::iota(sources.begin(), sources.end(), 0);
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        const int count = trails.count(i);
        if (count == 0) continue;
        lines.sizes.push_back(static_cast<std::uint32_t>(count) + 1);
        lines.vertices.push_back(i);
        for (int place = 1; place <= count; ++place) {
            lines.vertices.push_back(static_cast<std::uint32_t>(sources.size()));
            sources.push_back(i);
        }
    }
    if (lines.sizes.empty()) return {points, {}, {}};
    lines.points = points.select(sources);
    const std::span<Vec3f> P = lines.points.P().write();
    const std::span<std::uint8_t> is_place = lines.points.group(trail_places_group).write();
    std::size_t next = points.size();
    for (std::size_t i = 0; i < points.size(); ++i)
        for (int place = 1; place <= trails.count(i); ++place, ++next)
            P[next] = trails.at(i, place), is_place[next] = 1;
    return lines;
}

}  // namespace

PointLines with_lines(const PointSet& points)
{
    if (const Trails trails(points); trails.places() > 0) return lines_of_trails(points, trails);
    PointLines lines{points, {}, {}};
    const auto* curve = points.find<std::int32_t>(curve_attribute);
    for (std::uint32_t i = 0; curve && i < points.size();) {
        std::uint32_t end = i + 1;
        while (end < points.size() && (*curve)[end] == (*curve)[i]) ++end;
        if ((*curve)[i] >= 0 && end - i > 1) {
            lines.sizes.push_back(end - i);
            for (; i < end; ++i) lines.vertices.push_back(i);
        }
        i = end;
    }
    return lines;
}

PointSet without_trail_places(PointSet points)
{
    const Column<std::uint8_t>* is_place = points.find_group(trail_places_group);
    if (!is_place) return points;
    std::vector<std::uint8_t> keep(points.size());
    for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = (*is_place)[i] == 0;
    points.remove_group(trail_places_group);
    points.keep(keep);
    return points;
}

PointSet in_order_of_lines(const PointLines& lines)
{
    if (lines.sizes.empty()) return lines.points;
    std::vector<std::uint32_t> order = lines.vertices;
    std::vector<std::int32_t> curves;
    for (std::size_t line = 0; line < lines.sizes.size(); ++line)
        curves.insert(curves.end(), lines.sizes[line], static_cast<std::int32_t>(line));
    std::vector<bool> is_on(lines.points.size());
    for (const std::uint32_t i : lines.vertices) is_on[i] = true;
    for (std::uint32_t i = 0; i < lines.points.size(); ++i)
        if (!is_on[i]) order.push_back(i), curves.push_back(-1);
    PointSet points = lines.points.select(order);
    points.set(curve_attribute, Column<std::int32_t>(std::span<const std::int32_t>(curves)));
    return points;
}

}  // namespace rapid
