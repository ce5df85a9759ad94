// Rods and springs between points, by rows.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/rows.h"

namespace rapid::test {

constexpr float immovable = std::numeric_limits<float>::infinity();

// A rod or spring between two points.
struct Rod {
    static constexpr int points = 2;
    static constexpr bool rests = true;
    double rest;

    double residual(const std::array<Vec3d, 2>& P, std::array<Vec3d, 2>& gradient) const
    {
        const Vec3d d = P[0] - P[1];
        gradient[0] = d.normalized();
        gradient[1] = -gradient[0];
        return d.norm() - rest;
    }
};

template <class Function>
class RowsConstraint : public Constraint {
public:
    std::shared_ptr<Rows<Function>> rows = std::make_shared<Rows<Function>>();

    std::shared_ptr<Coupling> begin(const PointSet& points, double) const override
    {
        rows->follow(points, group);
        return rows;
    }
    std::shared_ptr<const Constraint> twin(const Constraint* before) const override
    {
        return twin_of(*this, &RowsConstraint::rows, before);
    }
};

template <class Function = Rod>
std::shared_ptr<RowsConstraint<Function>> rods(const std::vector<std::array<std::int64_t, 2>>& pairs, double length,
                                               double compliance = 0)
{
    auto made = std::make_shared<RowsConstraint<Function>>();
    made->node = "rods1";
    for (const auto& pair : pairs) made->rows->add(pair, {length}, compliance);
    return made;
}

inline std::vector<std::array<std::int64_t, 2>> links_of_chain(std::int64_t n)
{
    std::vector<std::array<std::int64_t, 2>> pairs;
    for (std::int64_t k = 0; k < n; ++k) pairs.push_back({k, k + 1});
    return pairs;
}

}  // namespace rapid::test
