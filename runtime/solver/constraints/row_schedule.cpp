#include "runtime/solver/constraints/row_schedule.h"

namespace rapid {

RowSchedule::RowSchedule(std::span<const std::uint32_t> rows, std::span<const std::uint32_t> points, std::size_t arity,
                         std::span<const std::uint8_t> fixed, bool trees)
{
    std::vector<std::uint32_t> points_left(points.begin(), points.end());
    others_.assign(rows.begin(), rows.end());
    if (trees) {
        forest_ = Forest(points, fixed.size(), fixed);
        for (Forest::Link& link : forest_.links) link.row = rows[link.row];
        others_.clear();
        points_left.clear();
        for (const std::uint32_t r : forest_.leftover) {
            others_.push_back(rows[r]);
            for (std::size_t k = 0; k < arity; ++k) points_left.push_back(points[r * arity + k]);
        }
    }
    colours_ = GraphColouring(points_left, arity, fixed.size());
}

}  // namespace rapid
