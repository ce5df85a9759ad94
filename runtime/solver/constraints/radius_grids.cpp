#include "runtime/solver/constraints/radius_grids.h"

#include <tbb/parallel_sort.h>

#include <algorithm>

#include "runtime/vec.h"

namespace rapid {

RadiusGrids::RadiusGrids(Strided<float> radius, std::size_t size, std::optional<double> max_difference, int max_grids)
{
    if (size == 0) return;
    std::vector<float> sorted;  // distinct, descending
    if (radius.stride == 0) {
        sorted.push_back(radius[0]);
    } else {
        sorted.assign(radius.data, radius.data + size);
        tbb::parallel_sort(sorted.begin(), sorted.end(), std::greater<>());
        sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    }
    const bool some_without = !(sorted.back() > 0);
    while (!sorted.empty() && !(sorted.back() > 0)) sorted.pop_back();

    std::vector<float> least;  // lower bound of the radii in each grid
    cluster(sorted, max_difference, max_grids, least);
    if (grids.size() > 1 || some_without)
        assign(radius, size, least);
    else if (!grids.empty())
        grids[0].points = size;
    measure(radius, size);
}

void RadiusGrids::cluster(std::span<const float> descending, std::optional<double> max_difference, int max_grids,
                          std::vector<float>& least)
{
    const auto most = static_cast<std::size_t>(std::clamp<int>(max_grids, 1, none - 1));
    const auto is_too_small = [&](double r, const Grid& grid) {
        return grid.radius - r > max_difference.value_or(0.5 * grid.radius);
    };
    for (const float r : descending) {
        if (grids.empty() || (is_too_small(r, grids.back()) && grids.size() < most)) {
            grids.push_back({r, 0});
            least.push_back(r);
        }
        least.back() = r;
    }
}

void RadiusGrids::assign(Strided<float> radius, std::size_t size, std::span<const float> least)
{
    of.resize(size);
    for (std::size_t i = 0; i < size; ++i) {
        std::size_t g = 0;
        while (g < grids.size() && radius[i] < least[g]) ++g;
        if (!(radius[i] > 0)) g = grids.size();
        of[i] = g < grids.size() ? static_cast<std::uint8_t>(g) : none;
        if (g < grids.size()) ++grids[g].points;
    }
}

void RadiusGrids::measure(Strided<float> radius, std::size_t size)
{
    double cells = 0, spheres = 0, cut = 0;
    for (std::size_t i = 0; i < size; ++i) {
        if (!of.empty() && of[i] == none) continue;
        const double s = 2 * grids[of.empty() ? 0 : of[i]].radius, d = 2.0 * radius[i];
        cells += s * s * s;
        cut += d * d * d;
        spheres += EIGEN_PI / 6 * d * d * d;
    }
    error = cells - spheres;
    excess = cut > 0 ? (cells - cut) / cut : 0;
}

}  // namespace rapid
