#include "runtime/solver/constraints/shape_grip.h"

#include <bit>

#include "runtime/parallel.h"

namespace rapid {
namespace {

// The largest change of a normal that does not wake: a slope of 0.06 degrees.
constexpr float same_normal = 1e-3f;

// One step of FNV-1a.
std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) { return (hash ^ value) * 0x100000001b3u; }

}  // namespace

bool ShapeGrip::is_like(const ShapeGrip& other) const
{
    return hash == other.hash && (normal - other.normal).norm() <= same_normal;
}

std::vector<ShapeGrip> shape_grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                                   std::span<const Vec3d> P, double time)
{
    std::vector<ShapeGrip> result(points.size());
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> asked;
        std::vector<Vec3d> at, gradient;
        std::vector<double> phi, times, reach;
        for (std::size_t o = 0; o < obstacles.size(); ++o) {
            const Obstacle& obstacle = obstacles[o];
            asked.clear();
            at.clear();
            reach.clear();
            for (std::size_t k = begin; k < end; ++k) {
                const std::uint32_t i = points[k];
                const double radius = obstacle.radius[i];
                const double near = radius + std::max(touch * radius, obstacle.contact_tolerance(P[i], radius));
                if (!obstacle.members[i] || obstacle.bounds.squaredExteriorDistance(P[i]) > near * near) continue;
                asked.push_back(static_cast<std::uint32_t>(k));
                at.push_back(P[i]);
                reach.push_back(near);
            }
            if (asked.empty()) continue;
            phi.resize(at.size());
            gradient.resize(at.size());
            times.assign(at.size(), time);
            obstacle.shape->distance_at(at, times, phi, gradient);
            for (std::size_t k = 0; k < asked.size(); ++k) {
                if (phi[k] > reach[k]) continue;
                const std::uint32_t i = points[asked[k]];
                const bool sunk = phi[k] < 2 * obstacle.radius[i] - reach[k];
                ShapeGrip& grip = result[asked[k]];
                grip.normal += gradient[k].normalized().cast<float>();
                for (const std::uint64_t value :
                     {std::uint64_t(o + 1), std::uint64_t(std::bit_cast<std::uint32_t>(obstacle.friction[i])),
                      std::uint64_t(std::bit_cast<std::uint32_t>(obstacle.bounce[i])),
                      static_cast<std::uint64_t>(obstacle.response), std::uint64_t(sunk)})
                    grip.hash = mixed(grip.hash, value);
            }
        }
    });
    return result;
}

}  // namespace rapid
