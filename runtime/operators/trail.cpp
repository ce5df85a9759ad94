// trail: keeps the last places of each point.
#include "runtime/points/trail.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/parallel.h"

namespace rapid {
namespace {

struct Trail {
    int places;

    static NodeType declare()
    {
        return node<Trail>("trail", "Keeps the last places of each point: trail1 is that of a frame ago, and so on.")
            .varies()
            .param(&Trail::places, "places", 12.0, between(1, most_trail_places), "", "frames that a trail is long")
            .constant();
    }

    void uses(Uses& uses) const
    {
        for (const AttributeSpec& column : trail_columns(places)) {
            uses.makes.push_back(column);
            uses.reads.push_back(column.name);  // each place becomes the next one
            uses.writes.push_back(column.name);
        }
    }

    // Before Solve: a point is where it was at the end of the frame before, or was born.
    void edit(PointSet& points, const Evaluation&) const
    {
        for (int place = places; place > 1; --place) points.set(trail_name(place), *points.find(trail_name(place - 1)));
        points.set(trail_name(1), points.P());
        const std::span<std::int32_t> count = points.column<std::int32_t>(trail_count_name).write();
        for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) count[i] = std::min(count[i] + 1, places);
        });
    }
};
RAPID_NODE(Trail);
RAPID_COUPLING("trail", Trail);

}  // namespace
}  // namespace rapid
