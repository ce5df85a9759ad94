#include "runtime/points/neighbours.h"

#include <fmt/format.h>

#include <numeric>

#include "runtime/base/error.h"

namespace rapid {
namespace {

constexpr float reach = 0.5f;  // per point, in radii

// Every accepted radius exceeds this unless all points are at the origin.
constexpr double min_radius = 0x1p-200;

}  // namespace

Neighbours::Neighbours(std::span<const Vec3f> P, double radius)
    : P_(P.size()), radius_(radius), spheres_{P_, {&reach, 0}, Vec3d::Zero(), 1 / std::max(radius, min_radius)}
{
    float largest = 0;
    for (const Vec3f& x : P) largest = std::max(largest, x.cwiseAbs().maxCoeff());
    if (!(radius > 0) || !(largest / radius < 0x1p30))
        throw Error(
            fmt::format("neighbours within {:g} m of points up to {:g} m from the origin; the radius must be "
                        "above 0, and above {:g} m there",
                        radius, largest, largest * 0x1p-30));
    if (P.empty()) return;
    for (std::size_t i = 0; i < P.size(); ++i) spheres_.middle += P_[i] = P[i].cast<double>();
    spheres_.middle /= static_cast<double>(P.size());
    double extent = 0;
    for (const Vec3d& x : P_) extent = std::max(extent, spheres_.in_grid(x).cwiseAbs().maxCoeff());
    blur_ = near_blur(extent);
    // Leaves room for the rounding of cell bounds, and is wide enough that no point reaches the clamped last cell.
    grid_.width = std::max(1 + 0x1p-20, extent * 0x1p-19);
    PageArray<std::uint32_t> all(P.size());
    std::iota(all.begin(), all.end(), 0u);
    CellSorter().fill(grid_, spheres_, all);
}

void Neighbours::find(const Vec3d& X, std::vector<std::uint32_t>& indices) const
{
    indices.clear();
    if (P_.empty()) return;
    for (const CellGrid::Run& run : grid_.around(grid_.cell_at(spheres_.in_grid(X))))
        for (std::uint32_t o = run.begin; o < run.end; ++o)
            if (is_near(grid_.index[o], X)) indices.push_back(grid_.index[o]);
    std::sort(indices.begin(), indices.end());
}

void Neighbours::list(std::size_t sphere, const NearSpheres& spheres, std::span<std::uint32_t> found,
                      std::vector<std::uint32_t>& near) const
{
    const Vec3d& X = P_[grid_.index[sphere]];
    std::uint32_t count = 0;
    spheres.for_each(grid_, sphere, blur_, 0, [&](std::uint32_t o, bool certain) {
        const std::uint32_t point = grid_.index[o];
        if (certain || is_near(point, X)) found[count++] = point;
    });
    near.resize(count);
    sort_few(found.data(), count, near.data());
}

}  // namespace rapid
