#include "runtime/solver/constraints/shape_grip.h"

#include "runtime/parallel.h"

namespace rapid {

std::vector<float> shape_grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                               std::span<const Vec3d> P, double time)
{
    constexpr float sunk = 1000;  // what a shape that has come over a point, however slowly, adds
    std::vector<float> result(points.size(), 0.0f);
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> asked;
        std::vector<Vec3d> at;
        std::vector<double> phi, times;
        for (const Obstacle& obstacle : obstacles) {
            asked.clear();
            at.clear();
            for (std::size_t k = begin; k < end; ++k) {
                const std::uint32_t i = points[k];
                const double reach = (1 + touch) * obstacle.radius[i];
                if (!obstacle.members[i] || obstacle.bounds.squaredExteriorDistance(P[i]) > reach * reach) continue;
                asked.push_back(static_cast<std::uint32_t>(k));
                at.push_back(P[i]);
            }
            if (asked.empty()) continue;
            phi.resize(at.size());
            times.assign(at.size(), time);
            obstacle.shape->distance_at(at, times, phi, {});
            for (std::size_t k = 0; k < asked.size(); ++k) {
                const std::uint32_t i = points[asked[k]];
                const double radius = obstacle.radius[i];
                if (phi[k] <= (1 + touch) * radius) result[asked[k]] += 1 + obstacle.friction[i];
                if (phi[k] < (1 - touch) * radius) result[asked[k]] += sunk;
            }
        }
    });
    return result;
}

}  // namespace rapid
