// trail: stores the last positions of each point.
//
// Between Create and Solve the trail is part of the points, and both are fed back to the next frame. Elsewhere nothing
// is fed back, so the node remembers the points of the previous frame, by id.
#include <algorithm>
#include <utility>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/graph/stateful.h"
#include "runtime/points/id_index.h"
#include "runtime/points/trail.h"

namespace rapid {
namespace {

// Returns the values of the points at these indices; `none` for missing points.
template <class T>
Column<T> values_at(std::span<const std::uint32_t> indices, const Column<T>& from, const T& none)
{
    Column<T> values(indices.size(), none);
    const std::span<T> to = values.overwrite();
    const Strided<T> old = from.read();
    for_each_chunk(indices.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = indices[i] == IdIndex::none ? none : old[indices[i]];
    });
    return values;
}

bool have_same_ids(const PointSet& a, const PointSet& b)
{
    const Strided<std::int64_t> of_a = a.id().read(), of_b = b.id().read();
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (of_a[i] != of_b[i]) return false;
    return true;
}

struct Trail {
    int places;

    static NodeType declare()
    {
        return node<Trail>("trail", "Records the positions of each point in its last frames as trail1, trail2, ...")
            .varies()
            .param(&Trail::places, "places", 12.0, between(1, max_trail_places), "",
                   "number of frames that are recorded")
            .constant();
    }

    void uses(Uses& uses) const
    {
        for (const AttributeSpec& column : trail_columns(places)) {
            uses.makes.push_back(column);
            uses.reads.push_back(column.name);  // each position becomes the next one
            uses.writes.push_back(column.name);
        }
    }

    void edit(PointSet& points, const Evaluation& now)
    {
        // The points have not moved yet: they have their positions from the end of the previous frame, or from birth.
        if (now.is_fed_back) return lengthen(points);

        if (now.at_start) before_ = PointSet();
        PointSet trails = trails_before(points);
        lengthen(trails);
        for (const AttributeSpec& column : trail_columns(places)) {
            points.add(column);
            points.set(column.name, *trails.find(column.name));
        }
        trails.P() = points.P();
        before_ = std::move(trails);
    }

    static std::unique_ptr<Operator> make() { return stateful<Trail>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(before_);
    }

private:
    // Adds the position of each point to its trail.
    void lengthen(PointSet& points) const
    {
        for (int place = places; place > 1; --place) {
            Column<Vec3f> next = points.column<Vec3f>(trail_name(place - 1));
            points.set(trail_name(place), std::move(next));
        }
        points.set(trail_name(1), points.P());
        const std::span<std::int32_t> count = points.column<std::int32_t>(trail_count_name).write();
        for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) count[i] = count[i] < places ? count[i] + 1 : places;
        });
    }

    // Returns the positions and trails of these points in the previous frame. The count of a new point is -1, because
    // lengthen() makes it 0.
    PointSet trails_before(const PointSet& points)
    {
        PointSet before = std::exchange(before_, PointSet());
        for (const AttributeSpec& column : trail_columns(places)) before.add(column);
        if (have_same_ids(points, before)) return before;
        const IdIndex index(std::as_const(before).id());
        const Strided<std::int64_t> ids = points.id().read();
        std::vector<std::uint32_t> indices(points.size());
        for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) indices[i] = index[ids[i]];
        });
        PointSet trails;
        trails.append(points.size());
        trails.id() = points.id();
        trails.P() = values_at<Vec3f>(indices, std::as_const(before).P(), Vec3f::Zero());
        trails.set(trail_count_name,
                   values_at<std::int32_t>(indices, before.column<std::int32_t>(trail_count_name), -1));
        for (int place = 1; place <= places; ++place)
            trails.set(trail_name(place),
                       values_at<Vec3f>(indices, before.column<Vec3f>(trail_name(place)), Vec3f::Zero()));
        return trails;
    }

    PointSet before_;  // ids, positions and trails of the previous frame, if nothing is fed back
};
RAPID_NODE(Trail);
RAPID_COUPLING("trail", Trail);

}  // namespace
}  // namespace rapid
