// Compares the voxels near a mesh with a search over all triangles.
#include "runtime/shapes/level_set/mesh_blocks.h"

#include <rapidcheck.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>
#include <set>
#include <tuple>

#include "tests/shapes/mesh/distance_to_all.h"
#include "tests/test.h"

namespace rapid {
namespace {

// Returns triangles of up to the given size, including lines, points and slivers.
Mesh soup(std::mt19937& random, int triangles, double size, double spread)
{
    std::uniform_real_distribution<double> in(-1, 1);
    const auto any = [&] { return Vec3d(in(random), in(random), in(random)); };
    Mesh mesh;
    for (int t = 0; t < triangles; ++t) {
        const Vec3d at = spread * any(), along = size * std::abs(in(random)) * any();
        const double flat = t % 5 == 0 ? 0 : t % 5 == 1 ? 1e-6 : 1;
        const Vec3d corners[3] = {at, at + (t % 7 == 0 ? 0 : 1) * along, at + 0.4 * along + flat * size * any()};
        for (const Vec3d& corner : corners) mesh.positions.push_back(corner.cast<float>());
        mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    }
    return mesh;
}

}  // namespace

TEST_CASE("each voxel of a mesh's band has the distance to the nearest triangle, and no voxel is missing",
          "[mesh_band]")
{
    rc::prop("", [](unsigned seed) {
        std::mt19937 random(seed);
        const double size = std::pow(10, *rc::gen::inRange(-1, 3)), half_width = *rc::gen::inRange(1, 5);
        const Mesh mesh = soup(random, 12, size, 15);
        const MeshBand band(mesh, half_width);
        std::set<std::tuple<int, int, int>> near;
        std::array<float, MeshBand::voxels> distance;
        std::array<std::int32_t, MeshBand::voxels> nearest;
        // Tests a sample of the blocks, because large triangles have many voxels.
        const std::size_t every = 1 + band.size() / 40;
        for (std::size_t b = 0; b < band.size(); ++b) {
            const Eigen::Vector3i origin = band.origin(b);
            near.insert({origin.x(), origin.y(), origin.z()});
            if (b % every != 0) continue;
            band.measure(b, distance, nearest);
            for (int v = 0; v < int(MeshBand::voxels); ++v) {
                const double exact =
                    test::distance_to_all(mesh, (origin + Eigen::Vector3i(v / 64, v / 8 % 8, v % 8)).cast<double>());
                RC_ASSERT(std::abs(distance[v] - std::min(exact, half_width)) <= 1e-6 * (1 + size));
                RC_ASSERT((nearest[v] >= 0) == (distance[v] < static_cast<float>(half_width)));
            }
        }
        std::uniform_real_distribution<double> in(-15 - size, 15 + size);
        for (int k = 0; k < 300; ++k) {
            const Eigen::Vector3d P(std::round(in(random)), std::round(in(random)), std::round(in(random)));
            if (test::distance_to_all(mesh, P) >= half_width) continue;
            const Eigen::Vector3i origin = 8 * (P / 8).array().floor().matrix().cast<int>();
            RC_ASSERT(near.count({origin.x(), origin.y(), origin.z()}));
        }
    });
}

TEST_CASE("a mesh's band does not depend on threads, nor on which way faces look", "[mesh_band][threads]")
{
    std::mt19937 random(1);
    const Mesh mesh = soup(random, 3000, 5, 60);
    Mesh turned = mesh;
    for (Mesh::Triangle& t : turned.triangles) std::swap(t[0], t[1]);
    const auto bytes = [](const Mesh& of, std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const MeshBand band(of, 3);
        std::vector<std::tuple<std::array<int, 3>, std::array<float, MeshBand::voxels>,
                               std::array<std::int32_t, MeshBand::voxels>>>
            all(band.size());
        for (std::size_t b = 0; b < band.size(); ++b) {
            auto& [origin, distance, nearest] = all[b];
            const Eigen::Vector3i lowest = band.origin(b);
            origin = {lowest.x(), lowest.y(), lowest.z()};
            band.measure(b, distance, nearest);
        }
        return all;
    };
    const auto one = bytes(mesh, 1);
    CHECK(one.size() > 100);
    CHECK((bytes(mesh, 3) == one));
    CHECK((bytes(turned, 2) == one));
}

}  // namespace rapid
