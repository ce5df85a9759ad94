#include "runtime/points/neighbours.h"

#include <fmt/format.h>

#include <numeric>

#include "runtime/error.h"

namespace rapid {
namespace {

// Lists are short, mostly: std::sort would take longer to start.
void sort_few(std::vector<std::uint32_t>& list)
{
    if (list.size() > 32) return std::sort(list.begin(), list.end());
    for (std::size_t next = 1; next < list.size(); ++next) {
        const std::uint32_t value = list[next];
        std::size_t hole = next;
        for (; hole > 0 && list[hole - 1] > value; --hole) list[hole] = list[hole - 1];
        list[hole] = value;
    }
}

}  // namespace

Neighbours::Neighbours(std::span<const Vec3f> P, double radius) : P_(P.size()), radius_(radius)
{
    float largest = 0;
    for (const Vec3f& x : P) largest = std::max(largest, x.cwiseAbs().maxCoeff());
    if (!(radius > 0) || !(largest / radius < 0x1p30))
        throw Error(
            fmt::format("neighbours within {:g} m of points up to {:g} m from the origin; the radius must be "
                        "above 0, and above {:g} m there",
                        radius, largest, largest * 0x1p-30));
    for (std::size_t i = 0; i < P.size(); ++i) P_[i] = P[i].cast<double>();
    if (P.empty()) return;
    // The grid is in radii, so that no radius is too small for single precision.
    std::vector<Vec3d> scaled(P.size());
    for (std::size_t i = 0; i < P.size(); ++i) middle_ += scaled[i] = P_[i] / radius;
    middle_ /= static_cast<double>(P.size());
    double extent = 0;
    for (const Vec3d& x : scaled) extent = std::max(extent, (x - middle_).cwiseAbs().maxCoeff());
    blur_ = near_blur(extent);
    // With room for the rounding of cells' bounds; and no point so far that it would be put into the last cell.
    grid_.width = std::max(1 + 0x1p-20, extent * 0x1p-19);
    std::vector<std::uint32_t> all(P.size());
    std::iota(all.begin(), all.end(), 0u);
    const float reach = 0.5f;
    CellSorter().fill(grid_, {scaled, {&reach, 0}, middle_}, all);
}

void Neighbours::find(const Vec3d& X, std::vector<std::uint32_t>& indices) const
{
    indices.clear();
    if (P_.empty()) return;
    std::array<std::int64_t, 3> cell;
    for (std::size_t k = 0; k < 3; ++k) cell[k] = cell_coordinate(X[k] / radius_ - middle_[k], grid_.width);
    for (const CellGrid::Run& run : grid_.around(cell))
        for (std::uint32_t o = run.begin; o < run.end; ++o)
            if (is_near(grid_.place[o], X)) indices.push_back(grid_.place[o]);
    sort_few(indices);
}

CellGrid::Runs Neighbours::around(std::uint64_t key) const
{
    CellGrid::Runs runs;
    for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j) {
            const std::uint64_t middle = key + static_cast<std::uint64_t>(k) * grid_.layer_step() +
                                         static_cast<std::uint64_t>(j) * grid_.row_step();
            runs.add(grid_.run(middle - 1, middle + 1));
        }
    return runs;
}

void Neighbours::list(std::size_t sphere, const CellGrid::Runs& runs, std::vector<std::uint32_t>& near) const
{
    near.clear();
    const Vec3d& X = P_[grid_.place[sphere]];
    for_near_spheres(grid_, sphere, grid_, runs, blur_, [&](std::uint32_t o, bool certain) {
        const std::uint32_t point = grid_.place[o];
        if (certain || is_near(point, X)) near.push_back(point);
    });
    sort_few(near);
}

}  // namespace rapid
