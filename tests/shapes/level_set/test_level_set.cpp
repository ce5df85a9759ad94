#include "runtime/shapes/level_set/level_set.h"

#include <tbb/global_control.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "runtime/base/error.h"
#include "tests/files/temporary_folder.h"
#include "tests/shapes/mesh/distance_to_all.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Equals;
using rapid::test::close_to;

namespace {

using std::numbers::pi;

std::vector<Vec3d> random_points(std::size_t n, const Box3d& box)
{
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit;
    std::vector<Vec3d> points(n);
    for (Vec3d& P : points) P = box.min() + box.sizes().cwiseProduct(Vec3d(unit(random), unit(random), unit(random)));
    return points;
}

Box3d cube(double half) { return {Vec3d::Constant(-half), Vec3d::Constant(half)}; }

struct Sample {
    double phi;
    Vec3d gradient;
};

Sample sample_at(const Shape& shape, const Vec3d& P)
{
    Sample sample;
    shape.distance({&P, 1}, {&sample.phi, 1}, {&sample.gradient, 1});
    return sample;
}

// Returns a mesh with the parts of `a` and `b`.
MeshPtr joined(const MeshPtr& a, const MeshPtr& b)
{
    auto mesh = std::make_shared<Mesh>(*a);
    const auto first = static_cast<std::int32_t>(mesh->positions.size());
    mesh->positions.insert(mesh->positions.end(), b->positions.begin(), b->positions.end());
    for (const Mesh::Triangle& t : b->triangles) mesh->triangles.push_back(t.array() + first);
    mesh->name = "both";
    return mesh;
}

MeshPtr turned(const MeshPtr& mesh)
{
    auto inside_out = std::make_shared<Mesh>(*mesh);
    for (Mesh::Triangle& t : inside_out->triangles) std::swap(t[1], t[2]);
    return inside_out;
}

}  // namespace

// The error of a trilinear interpolant of f is at most h²/8 Σ max|∂²f/∂x²|. For the distance to a point the sum is
// 2/|x|.
TEST_CASE("a level set sphere is off by at most voxel²/(4 radius) within its band, and converges with voxel²",
          "[level set]")
{
    const double radius = 1;
    const Vec3d center(0.3, -0.2, 0.1);
    double worst[2] = {0, 0};
    for (const int k : {0, 1}) {
        const double voxel = 0.1 / (1 << k);
        const auto sphere = level_set_sphere(radius, center, {voxel, 4.0 * (1 << k)});
        double worst_gradient = 0;
        int queries = 0;
        for (const Vec3d& P : random_points(100'000, cube(1.5))) {
            const Vec3d from_center = P - center;
            const double exact = from_center.norm() - radius;
            if (std::abs(exact) > 2 * 0.1) continue;
            const auto [phi, gradient] = sample_at(*sphere, P);
            worst[k] = std::max(worst[k], std::abs(phi - exact));
            worst_gradient = std::max(worst_gradient, (gradient - from_center.normalized()).norm());
            ++queries;
        }
        CHECK(queries > 10'000);
        CHECK(worst[k] < voxel * voxel / (4 * (radius - 0.2 - voxel)) + 1e-6);
        CHECK(worst_gradient < std::numbers::sqrt3 * voxel / (radius - 0.2 - voxel));
    }
    CHECK(worst[0] / worst[1] == Approx(4).epsilon(0.2));
}

TEST_CASE("a level set box is exact to rounding along its faces, and round outside its edges", "[level set]")
{
    const auto box = level_set_box({2, 1, 0.6}, {0, 5, 0}, {0.02, 4});
    CHECK(sample_at(*box, {1.013, 5.2, 0.1}).phi == Approx(0.013).margin(1e-6));
    CHECK(sample_at(*box, {0.3, 5.2, -0.27}).phi == Approx(-0.03).margin(1e-6));
    CHECK_THAT(sample_at(*box, {0.3, 5.513, 0.1}).gradient, close_to(Vec3d{0, 1, 0}, 1e-5));
    CHECK(sample_at(*box, {1.03, 5.54, 0}).phi == Approx(0.05).margin(1e-3));  // a 3-4-5 triangle
}

TEST_CASE("a level set torus is the distance to its circle minus its tube", "[level set]")
{
    const auto torus = level_set_torus(0.5, 0.2, Vec3d::Zero(), {0.01, 4});
    int queries = 0;
    for (const Vec3d& P : random_points(50'000, cube(0.75))) {
        const double exact = std::hypot(std::hypot(P.x(), P.z()) - 0.5, P.y()) - 0.2;
        if (std::abs(exact) > 0.02) continue;
        REQUIRE(sample_at(*torus, P).phi == Approx(exact).margin(0.01 * 0.01 / 4 * (1 / 0.17 + 1 / 0.27)));
        ++queries;
    }
    CHECK(queries > 1000);
}

TEST_CASE("beyond the band the distance is a bound of the right sign, without a gradient", "[level set]")
{
    const auto sphere = level_set_sphere(1, Vec3d::Zero(), {0.05, 3});
    for (const Vec3d& P : random_points(20'000, cube(20))) {
        const double exact = P.norm() - 1;
        if (std::abs(exact) < 0.3) continue;
        const auto [phi, gradient] = sample_at(*sphere, P);
        REQUIRE(phi >= std::copysign(0.15, exact) * 1.000001 - 1e-6);
        REQUIRE((exact > 0 ? phi <= exact : phi == Approx(-0.15)));
        REQUIRE(gradient.isZero());
    }
    // Along an axis the box around the surface is as near as the surface, up to a voxel or two.
    CHECK(sample_at(*sphere, {11, 0, 0}).phi == Approx(10).margin(0.1));
    CHECK(sample_at(*sphere, Vec3d::Zero()).phi == Approx(-0.15));
    CHECK(sample_at(*sphere, {1e30, 0, 0}).phi == Approx(1e30));
}

TEST_CASE("outside a level set's bounds the distance is above 0, and at least that to the bounds", "[level set]")
{
    const auto torus = level_set_torus(0.5, 0.2, {1, 2, 3}, {0.02, 3});
    CHECK(torus->band() == Approx(0.06));
    const Box3d bounds = torus->bounds();
    CHECK(bounds.sizes().maxCoeff() < 1.4 + 5 * 0.02);
    CHECK(bounds.sizes().minCoeff() < 0.4 + 5 * 0.02);
    for (const Vec3d& P : random_points(50'000, {Vec3d(0, 1, 2), Vec3d(2, 3, 4)})) {
        if (bounds.contains(P)) continue;
        REQUIRE(sample_at(*torus, P).phi > 0);
        REQUIRE(sample_at(*torus, P).phi >= std::min(0.06, bounds.exteriorDistance(P)) - 1e-6);
    }
}

TEST_CASE("distances alone have the same bits as distances with gradients", "[level set]")
{
    const auto sphere = level_set_sphere(1, Vec3d::Zero(), {0.1, 3});
    const auto points = random_points(5000, cube(1.6));
    std::vector<double> alone(points.size()), together(points.size());
    std::vector<Vec3d> gradients(points.size());
    sphere->distance(points, alone, {});
    sphere->distance(points, together, gradients);
    CHECK(alone == together);
}

TEST_CASE("a level set is built and queried with the same bits on any number of threads", "[level set][threads]")
{
    std::vector<double> phi[2];
    const auto points = random_points(20'000, cube(1.3));
    for (const int k : {0, 1}) {
        const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, k == 0 ? 1 : 7);
        std::vector<std::string> warnings;
        const auto torus = level_set_from_mesh(make_torus(0.8, 0.3, 60, Vec3d::Zero()), {0.04, 3}, warnings);
        phi[k].resize(points.size());
        torus->distance(points, phi[k], {});
    }
    CHECK(phi[0] == phi[1]);
}

TEST_CASE("a level set from a mesh has the distance to the nearest triangle at every voxel", "[level set]")
{
    const double voxel = 0.05;
    const MeshPtr mesh = make_torus(0.8, 0.3, 12, Vec3d::Zero());  // 12 sides give it edges that a formula would miss
    std::vector<std::string> warnings;
    const auto torus = level_set_from_mesh(mesh, {voxel, 3}, warnings);
    CHECK(warnings.empty());
    double worst = 0;
    int queries = 0;
    for (int i = -24; i <= 24; ++i)
        for (int j = -8; j <= 8; ++j)
            for (int k = -24; k <= 24; ++k) {
                const Vec3d P = voxel * Vec3d(i, j, k);
                const double exact = test::distance_to_all(*mesh, P);
                if (exact > 2.5 * voxel) continue;
                worst = std::max(worst, std::abs(std::abs(sample_at(*torus, P).phi) - exact));
                ++queries;
            }
    CHECK(queries > 2000);
    CHECK(worst < 1e-3 * voxel);
}

TEST_CASE("a level set from a mesh is negative inside, whichever way its faces look", "[level set]")
{
    const MeshPtr sphere = make_sphere(1, 64, Vec3d::Zero());
    std::vector<std::string> none, warnings;
    const auto right = level_set_from_mesh(sphere, {0.05, 3}, none);
    const auto wrong = level_set_from_mesh(turned(sphere), {0.05, 3}, warnings);
    CHECK(none.empty());
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(
        warnings[0],
        Equals("mesh \"sphere\" is inside out: its volume is -4.172 m³; its faces are assumed to point outwards"));
    for (const Vec3d& P : random_points(2000, cube(1.3))) {
        REQUIRE(sample_at(*right, P).phi == sample_at(*wrong, P).phi);
        if (std::abs(P.norm() - 1) > 0.01) REQUIRE((sample_at(*right, P).phi < 0) == (P.norm() < 1));
    }
}

TEST_CASE("a piece turned inwards inside another is a cavity, and one inside that is solid again", "[level set]")
{
    const MeshPtr wall = joined(make_sphere(1, 64, Vec3d::Zero()), turned(make_sphere(0.7, 64, Vec3d::Zero())));
    const MeshPtr mesh = GENERATE_COPY(joined(wall, make_sphere(0.4, 64, Vec3d::Zero())),
                                       turned(joined(wall, make_sphere(0.4, 64, Vec3d::Zero()))));
    std::vector<std::string> warnings;
    const auto shells = level_set_from_mesh(mesh, {0.025, 3}, warnings);
    const double flat = 3e-3;  // the meshes lie inside their spheres by up to this
    const auto at = [&](double x) { return sample_at(*shells, {x, 0.01, 0}).phi; };
    CHECK(at(1.03) == Approx(0.03).margin(flat));
    CHECK(at(0.97) == Approx(-0.03).margin(flat));
    CHECK(at(0.73) == Approx(-0.03).margin(flat));
    CHECK(at(0.67) == Approx(0.03).margin(flat));
    CHECK(at(0.55) > 0);
    CHECK(at(0.43) == Approx(0.03).margin(flat));
    CHECK(at(0.37) == Approx(-0.03).margin(flat));
    CHECK(at(0.0) < 0);
    CHECK(warnings.size() == (mesh->signed_volume() < 0 ? 1 : 0));
}

TEST_CASE("a separate piece turned inwards is solid, and overlapping pieces are one", "[level set]")
{
    std::vector<std::string> warnings;
    const auto pair = level_set_from_mesh(
        joined(make_sphere(1, 48, Vec3d::Zero()), turned(make_sphere(0.5, 48, {3, 0, 0}))), {0.05, 3}, warnings);
    CHECK(sample_at(*pair, {3, 0, 0}).phi < 0);
    CHECK(sample_at(*pair, {3.55, 0.01, 0}).phi > 0);

    const auto overlap = level_set_from_mesh(joined(make_sphere(1, 48, Vec3d::Zero()), make_sphere(1, 48, {1, 0, 0})),
                                             {0.05, 3}, warnings);
    for (const double x : {-0.9, 1.9}) CHECK(sample_at(*overlap, {x, 0, 0}).phi == Approx(-0.1).margin(0.005));
    for (const double x : {0.0, 0.03, 0.5, 0.97, 1.0})  // on and near the inner faces: far from the surface
        CHECK(sample_at(*overlap, {x, 0, 0}).phi == Approx(-0.15));
}

TEST_CASE("a hole smaller than a voxel is closed, with a warning", "[level set]")
{
    auto holed = std::make_shared<Mesh>(*make_sphere(1, 200, Vec3d::Zero()));
    holed->triangles.erase(holed->triangles.begin() + 10'000);
    std::vector<std::string> warnings;
    const auto sphere = level_set_from_mesh(holed, {0.1, 3}, warnings);
    CHECK(sample_at(*sphere, Vec3d::Zero()).phi < 0);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(
        warnings[0],
        Equals(
            "mesh \"sphere\" is not closed: 3 edges have one face, and 0 have more than two or two that face different "
            "ways; holes smaller than a voxel (0.1 m) are closed; with larger ones the inside counts as outside"));
}

TEST_CASE("pieces thinner than a voxel are named in a warning", "[level set]")
{
    std::vector<std::string> warnings;
    level_set_from_mesh(joined(make_sphere(1, 48, Vec3d::Zero()), make_box({1, 1, 0.01}, {3, 0, 0.02})), {0.1, 3},
                        warnings);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Equals("1 of the 2 pieces of mesh \"both\" are thinner than a voxel (0.1 m) and may be "
                                   "missing; use a smaller voxel"));
}

TEST_CASE("meshes that can't become a level set are refused with the numbers, before it is built", "[level set]")
{
    const Vec3d o = Vec3d::Zero();
    std::vector<std::string> w;
    const MeshPtr sphere = make_sphere(1, 16, o);
    CHECK_THAT(test::error_of([&] {
                   level_set_from_mesh(sphere, {0, 3}, w);
               }),
               Equals("voxel = 0 m is out of range; it must be above 0"));
    CHECK_THAT(test::error_of([&] {
                   level_set_sphere(1, o, {0.1, 1});
               }),
               Equals("half_width = 1 voxels is out of range; it must be at least 2"));
    CHECK_THAT(test::error_of([&] { level_set_sphere(0, o, {}); }),
               Equals("radius of a level set sphere = 0 is out of range; it must be above 0"));
    CHECK_THAT(test::error_of([&] { level_set_torus(1, 1, o, {}); }),
               Equals("tube of a level set torus = 1 is out of range; it must be below its radius, 1"));
    CHECK_THAT(test::error_of([&] {
                   level_set_from_mesh(make_mesh({{0, 0, 0}}, {}), {}, w);
               }),
               Equals("mesh \"points and faces\" has no faces; a level set needs a closed surface"));
    // 4 π / 1e-10 voxels per layer, times 6 layers.
    CHECK_THAT(
        test::error_of([&] {
            level_set_sphere(1, o, {1e-5, 3});
        }),
        Equals("a level set sphere of radius 1 m with voxel = 1e-05 m would make about 7.54e+11 voxels and an index "
               "of 1.56e+13 blocks, but at most 2147483648 of each are possible; use a voxel of at least 0.000198 m"));
    CHECK_THAT(test::error_of([&] {
                   level_set_from_mesh(sphere, {1e-5, 3}, w);
               }),
               Catch::Matchers::StartsWith("mesh \"sphere\" with voxel = 1e-05 m would make about "));
    CHECK_THAT(
        test::error_of([&] {
            level_set_sphere(0.04, o, {0.1, 3});
        }),
        Equals("a level set sphere of radius 0.04 m vanishes with voxel = 0.1 m: it is 0.08 m thick; use a voxel of "
               "at most 0.04 m"));
    CHECK_THAT(
        test::error_of([&] {
            level_set_from_mesh(make_box({0.1, 0.1, 0.02}, {0.05, 0.05, 0.05}), {0.3, 3}, w);
        }),
        Equals("mesh \"box\" vanishes with voxel = 0.3 m: its size is 0.1 x 0.1 x 0.02 m; use a voxel of at most "
               "0.00667 m"));
    CHECK_THAT(
        test::error_of([&] {
            level_set_from_mesh(make_grid(2, 2, 4, {0, 0.02, 0}), {0.1, 3}, w);
        }),
        Equals("mesh \"grid\" has no inside with voxel = 0.1 m, because 16 of its edges have one face; close it: for a "
               "ground, add a copy of its outer edge lower down, faces between the two, and a bottom"));
}

TEST_CASE("a wider band is the same surface with exact distances farther out", "[level set]")
{
    const double radius = 0.5, voxel = 0.05, wide = 0.4;
    std::vector<std::string> warnings;
    const LevelSetPtr from_formula = level_set_sphere(radius, Vec3d::Zero(), {voxel, 3});
    const LevelSetPtr from_mesh = level_set_from_mesh(make_sphere(radius, 96, Vec3d::Zero()), {voxel, 3}, warnings);
    for (const LevelSetPtr& narrow : {from_formula, from_mesh}) {
        CHECK(narrow->with_band(2 * voxel) == narrow);
        const LevelSetPtr widened = narrow->with_band(wide);
        CHECK(widened->band() >= wide);
        CHECK(widened->with_band(wide) == widened);
        CHECK(widened->voxel() == narrow->voxel());
        CHECK(widened->active_voxels() > 2 * narrow->active_voxels());
        for (const Vec3d& P : random_points(5000, cube(1))) {
            const double exact = P.norm() - radius;
            if (exact > -0.3 && exact < 0.3) REQUIRE(sample_at(*widened, P).phi == Approx(exact).margin(0.004));
            if (std::abs(exact) < voxel)
                REQUIRE(sample_at(*widened, P).phi == Approx(sample_at(*narrow, P).phi).margin(1e-6));
        }
    }
    CHECK_THAT(test::error_of([&] { from_formula->with_band(1e6); }),
               Catch::Matchers::Contains("are possible; use a voxel") || Catch::Matchers::Contains("are free; "));
}

TEST_CASE("a level set far from the origin is as good as one at it", "[level set]")
{
    const Vec3d far(1e5, -1e5, 1e5);
    const auto sphere = level_set_sphere(1, far, {0.05, 3});
    CHECK(sample_at(*sphere, far + Vec3d(1.02, 0, 0)).phi == Approx(0.02).margin(1e-3));
    CHECK(sample_at(*sphere, far).phi == Approx(-0.15));

    // At this distance the mesh's coordinates have a spacing of 7.8 mm.
    std::vector<std::string> warnings;
    const auto box = level_set_from_mesh(make_box({2, 2, 2}, far), {0.05, 3}, warnings);
    CHECK(sample_at(*box, far + Vec3d(1.02, 0.3, 0)).phi == Approx(0.02).margin(1e-4));
}

TEST_CASE("level sets of millimetres and of kilometres are alike", "[level set]")
{
    const double size = GENERATE(1e-3, 1.0, 1e5);
    const auto sphere = level_set_sphere(size, Vec3d::Zero(), {0.05 * size, 3});
    CHECK(sample_at(*sphere, {1.1 * size, 0, 0}).phi == Approx(0.1 * size).epsilon(0.01));
    CHECK_THAT(sample_at(*sphere, {0, 0, 0.9 * size}).gradient, close_to(Vec3d{0, 0, 1}, 0.03));  // voxel / (2 radius)
}

TEST_CASE("the surface of a level set is a closed mesh of its area, looking outwards", "[level set]")
{
    const auto sphere = level_set_sphere(1, {0, 2, 0}, {0.05, 3});
    const MeshPtr mesh = sphere->surface();
    CHECK(mesh->openness().closed());
    CHECK(mesh->signed_volume() == Approx(4.0 / 3 * pi).epsilon(0.005));
    CHECK(mesh->area() == Approx(4 * pi).epsilon(0.005));
    CHECK(sphere->surface() == mesh);  // created once
}

TEST_CASE("a scanned mesh's level set encloses the mesh's volume", "[level set]")
{
    const auto path = std::filesystem::path(RAPID_SOURCE_DIR).parent_path() / "shared/assets/meshes/spot.obj";
    if (!std::filesystem::exists(path)) {
        WARN("left out: there is no " << path);
        return;
    }
    const MeshPtr spot = read_mesh(path);
    std::vector<std::string> warnings;
    const auto level_set = level_set_from_mesh(spot, {0.01, 3}, warnings);
    CHECK(warnings.empty());
    CHECK(level_set->surface()->signed_volume() == Approx(spot->signed_volume()).epsilon(0.005));
}
