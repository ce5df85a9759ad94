// Compares baked level sets with their OpenVDB grids and with winding numbers.
#include "runtime/shapes/level_set/baked_level_set.h"

#include <rapidcheck.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <memory>
#include <new>
#include <numbers>
#include <random>

#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/mesh_blocks.h"
#include "tests/test.h"

namespace rapid {
namespace {

void require_same(const BakedGrid& a, const BakedGrid& b)
{
    RC_ASSERT(a.origin == b.origin);
    RC_ASSERT(a.voxel == b.voxel);
    RC_ASSERT(a.background == b.background);
    RC_ASSERT(a.blocks == b.blocks);
    RC_ASSERT(a.index == b.index);
    RC_ASSERT(a.values == b.values);
    RC_ASSERT(a.surface.isApprox(b.surface, 0));
    RC_ASSERT(a.slope == b.slope);
    RC_ASSERT(a.crossings == b.crossings);
}

void require_same_as_grid(const LevelSetPtr& shape)
{
    const auto& level_set = dynamic_cast<const BakedLevelSet&>(*shape);
    require_same(level_set.baked(), bake(grid_of(level_set)));
    RC_ASSERT(level_set.active_voxels() == grid_of(level_set).activeVoxelCount());
}

double between(double low, double high) { return low + (high - low) * 1e-4 * *rc::gen::inRange(0, 10'001); }

Vec3d any_place(double reach) { return {between(-reach, reach), between(-reach, reach), between(-reach, reach)}; }

// Returns balls, boxes and tori, some nested, some turned inwards, and possibly overlapping.
MeshPtr any_mesh(const Vec3d& around)
{
    auto mesh = std::make_shared<Mesh>();
    mesh->name = "any";
    for (int part = *rc::gen::inRange(1, 4); part > 0; --part) {
        const Vec3d center = around + any_place(1.5);
        const int kind = *rc::gen::inRange(0, 3), divisions = *rc::gen::inRange(6, 20);
        const double size = between(0.1, 1);
        const MeshPtr piece = kind == 0   ? make_sphere(size, divisions, center)
                              : kind == 1 ? make_box({size, 1.3 * size, 0.7 * size}, center)
                                          : make_torus(size, 0.4 * size, divisions, center);
        const auto first = static_cast<std::int32_t>(mesh->positions.size());
        mesh->positions.insert(mesh->positions.end(), piece->positions.begin(), piece->positions.end());
        const bool inwards = *rc::gen::inRange(0, 3) == 0;
        for (Mesh::Triangle t : piece->triangles) {
            t += Mesh::Triangle::Constant(first);
            if (inwards) std::swap(t[0], t[1]);
            mesh->triangles.push_back(t);
        }
    }
    return mesh;
}

// Computes the winding number from the solid angles of the faces (van Oosterom and Strackee 1983).
int winding_number(const Mesh& mesh, const Vec3d& P)
{
    double sum = 0;
    for (const Mesh::Triangle& t : mesh.triangles) {
        const Vec3d a = mesh.positions[t[0]].cast<double>() - P, b = mesh.positions[t[1]].cast<double>() - P,
                    c = mesh.positions[t[2]].cast<double>() - P;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return static_cast<int>(std::lround(sum / (4 * std::numbers::pi)));
}

}  // namespace

TEST_CASE("a level set of a mesh is bit-identical to one baked from its OpenVDB grid", "[level set][baked]")
{
    int measured = 0;  // the others are baked from the grid anyway
    rc::prop("", [&] {
        // A distant mesh has its voxel frame near the mesh.
        const MeshPtr mesh = any_mesh(*rc::gen::inRange(0, 3) == 0 ? Vec3d(2000, -3000, 2500) : Vec3d::Zero());
        const LevelSetOptions options{between(0.04, 0.12), between(2, MeshBlocks::widest)};
        const double wider = between(2, 8);  // voxels
        std::vector<std::string> warnings;
        const LevelSetPtr level_set = level_set_from_mesh(mesh, options, warnings);
        require_same_as_grid(level_set);
        require_same_as_grid(level_set->with_band(wider * options.voxel));
        const VoxelFrame frame = frame_around(mesh->bounds().cast<double>(), options.voxel);
        measured += !measure(*mesh, frame, options.half_width * options.voxel).overlap;
    });
    CHECK(measured > 30);
}

TEST_CASE("spheres, boxes and tori are bit-identical to those baked from their OpenVDB grids", "[level set][baked]")
{
    rc::prop("", [] {
        const Vec3d center = (*rc::gen::inRange(0, 3) == 0 ? 3000.0 : 1.0) * any_place(1.5);
        const double size = between(0.2, 1);
        const LevelSetOptions options{between(0.04, 0.12), between(2, 12)};
        require_same_as_grid(level_set_sphere(size, center, options));
        require_same_as_grid(level_set_box({size, 1.3 * size, 0.7 * size}, center, options));
        require_same_as_grid(level_set_torus(size, 0.7 * size, center, options));
    });
}

TEST_CASE("a level set of a mesh is negative where the winding number is not 0", "[level set][baked]")
{
    rc::prop("", [](unsigned seed) {
        const MeshPtr mesh = any_mesh(Vec3d::Zero());
        const double voxel = between(0.04, 0.12);
        std::vector<std::string> warnings;
        const LevelSetPtr level_set = level_set_from_mesh(mesh, {voxel, 3}, warnings);
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> place(-3, 3);
        for (int n = 0; n < 300; ++n) {
            const Vec3d P(place(random), place(random), place(random));
            double phi;
            level_set->distance({&P, 1}, {&phi, 1}, {});
            // Nearer, the surface is limited by the voxels.
            if (std::abs(phi) > 2 * voxel) RC_ASSERT((phi < 0) == (winding_number(*mesh, P) != 0));
        }
    });
}

TEST_CASE("the grid and the surface of a level set are built once for all threads", "[level set][baked][threads]")
{
    std::vector<std::string> warnings;
    const LevelSetPtr shape = level_set_from_mesh(make_torus(0.8, 0.3, 40, Vec3d::Zero()), {0.03, 3}, warnings);
    const auto& level_set = dynamic_cast<const BakedLevelSet&>(*shape);
    std::vector<MeshPtr> surfaces(200);
    std::vector<LevelSetGridPtr> grids(surfaces.size());
    tbb::parallel_for(std::size_t{0}, surfaces.size(), [&](std::size_t i) {
        if (i % 2) surfaces[i] = shape->surface();
        grids[i] = level_set.grid();
        surfaces[i] = shape->surface();
    });
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        REQUIRE(surfaces[i] == surfaces[0]);
        REQUIRE(grids[i] == grids[0]);
    }
    CHECK(surfaces[0]->openness().closed());
}

TEST_CASE("a level set builds its grid again after a failure", "[level set][baked]")
{
    int queries = 0;
    const auto grid = [&]() -> LevelSetGridPtr {
        if (++queries < 3) throw std::bad_alloc();
        return std::make_shared<const LevelSetGrid>();
    };
    const BakedLevelSet level_set(BakedGrid(), 0, {grid, {}});
    CHECK_THROWS_AS(level_set.grid(), std::bad_alloc);
    CHECK_THROWS_AS(level_set.surface(), std::bad_alloc);
    const LevelSetGridPtr made = level_set.grid();
    CHECK(made);
    CHECK(level_set.grid() == made);
    CHECK(queries == 3);
}

}  // namespace rapid
