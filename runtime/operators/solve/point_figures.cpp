#include "runtime/operators/solve/point_figures.h"

#include <algorithm>
#include <limits>

#include "runtime/points/id_index.h"

namespace rapid {

void PointFigures::begin(const PointSet& points, SolveOptions& options, bool has_tolerance)
{
    are_exact_ = false;
    substeps_ = options.substeps;
    if (!has_tolerance) return;
    ids_ = points.id();
    taken_.assign(points.size(), options.substeps);
    options.taken = taken_.data();
}

void PointFigures::note_errors(std::span<const std::int64_t> ids, std::span<const double> errors)
{
    known_.assign(ids.begin(), ids.end());
    errors_.assign(errors.begin(), errors.end());
}

void PointFigures::put(PointSet& points) const
{
    const bool tells_error = !points.has("error"), tells_substeps = !points.has("substeps");
    constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
    const IdIndex places(points.id());
    if (tells_error) {
        Column<float> column(points.size(), are_exact_ ? 0.0f : unknown, unknown);
        if (!known_.empty() && !points.empty()) {
            const std::span<float> to = column.write();
            for (std::size_t k = 0; k < known_.size(); ++k)
                if (const std::uint32_t i = places[known_[k]]; i != IdIndex::none) to[i] = errors_[k];
        }
        points.set("error", std::move(column));
    }
    if (tells_substeps) {
        Column<std::int32_t> column(points.size(), substeps_, 0);
        if (!taken_.empty() && !points.empty()) {
            const std::span<std::int32_t> to = column.write();
            const Strided<std::int64_t> before = ids_.read();
            for (std::size_t k = 0; k < taken_.size(); ++k)
                if (const std::uint32_t i = places[before[k]]; i != IdIndex::none) to[i] = taken_[k];
        }
        points.set("substeps", std::move(column));
    }
    if (points.has("asleep")) return;
    Column<std::int32_t> column(points.size(), 0, 0);
    if (!asleep_.empty() && !points.empty()) {
        const std::span<std::int32_t> to = column.write();
        for (const std::int64_t id : asleep_)
            if (const std::uint32_t i = places[id]; i != IdIndex::none) to[i] = 1;
    }
    points.set("asleep", std::move(column));
}

}  // namespace rapid
