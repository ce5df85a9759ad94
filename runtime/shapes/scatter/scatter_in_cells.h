// Births in a region defined by an inside test, uniform by volume.
//
// Equal cells cover the region. A birth draws a cell, then positions in it until one is inside (rejection). Cells that
// are wholly inside need no test, so the cost depends on the region's surface instead of its box.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

struct ScatterCells {
    Vec3d origin = Vec3d::Zero(), edge = Vec3d::Ones();  // m
    Eigen::Vector3i counts = Eigen::Vector3i::Zero();    // cells along each axis; cell numbers have z fastest
    std::vector<std::uint32_t> cells;                    // those wholly inside come first, then those partly inside
    std::size_t whole = 0;                               // number of cells wholly inside

    Vec3d low(std::uint32_t cell) const
    {
        const auto z = cell % std::uint32_t(counts.z()),
                   y = cell / std::uint32_t(counts.z()) % std::uint32_t(counts.y());
        const auto x = cell / std::uint32_t(counts.z()) / std::uint32_t(counts.y());
        return origin + Vec3d(x, y, z).cwiseProduct(edge);
    }
    double volume() const { return double(cells.size()) * edge.prod(); }
};

// Inside: bool operator()(const Vec3f& P) const.
template <class Inside>
class ScatterInCells final : public Scatter {
public:
    // volume: of the region, m³. Throws Error if it is too small a fraction of its cells for rejection to end.
    ScatterInCells(ScatterCells cells, Inside inside, double volume, const std::string& what)
        : cells_(std::move(cells)), inside_(std::move(inside))
    {
        if (!(volume > min_part * cells_.volume()))
            throw Error(
                fmt::format("the volume of {}, {:.3g} m³, is too thin to emit points: it is less than {:g} of the "
                            "cells around it; use its surface",
                            what, volume, min_part));
    }

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        std::array<Numbers, 64> numbers;  // for the first trial of each birth
        for (std::size_t i = 0; i < out.size(); ++i) {
            const std::size_t k = i % numbers.size();
            if (k == 0) uniform4(key, first + i, 0, std::span(numbers).first(std::min(numbers.size(), out.size() - i)));
            out[i] = Birthplace{};
            out[i].P = draw(key, first + i, numbers[k]);
        }
    }

private:
    static constexpr double min_part = 1e-5;
    // At the least fraction the probability of needing more is exp(-100).
    static constexpr std::uint64_t max_trials = 10'000'000;

    using Numbers = std::array<double, 4>;

    // u: random numbers of the first trial.
    Vec3f draw(RandomKey key, std::uint64_t birth, Numbers u) const
    {
        for (std::uint64_t trial = 0; trial < max_trials; u = uniform4(key, birth, ++trial << 32)) {
            const auto n = static_cast<std::size_t>(u[0] * double(cells_.cells.size()));
            const Vec3d in_cell = Vec3d(u[1], u[2], u[3]).cwiseProduct(cells_.edge);
            const Vec3f P = (cells_.low(cells_.cells[n]) + in_cell).template cast<float>();
            if (n < cells_.whole || inside_(P)) return P;
        }
        throw Error("no position was found in a volume that is too thin to emit points; use its surface");
    }

    ScatterCells cells_;
    Inside inside_;
};

}  // namespace rapid
