#include "runtime/shapes/scatter/scatter.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "runtime/base/error.h"
#include "runtime/base/parallel.h"
#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/level_set/level_set.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Equals;
using rapid::test::close_to;

namespace {

using std::numbers::pi;

std::vector<Birthplace> births(const ScatterPtr& scatter, std::size_t n, std::uint64_t seed = 1)
{
    std::vector<Birthplace> out(n);
    scatter->place(RandomKey(seed, "emit1"), 0, out);
    return out;
}

// Returns Pearson's sum over bins of (found - expected)² / expected.
double chi_square(const std::vector<double>& found, const std::vector<double>& expected)
{
    double sum = 0;
    for (std::size_t i = 0; i < found.size(); ++i) sum += std::pow(found[i] - expected[i], 2) / expected[i];
    return sum;
}

// Returns the 99.9th percentile of chi-square with these degrees of freedom (Wilson and Hilferty 1931). The keys are
// fixed, so a test that passes always passes.
double rarely_above(double degrees)
{
    const double z = 3.0902, k = 2 / (9 * degrees);
    return degrees * std::pow(1 - k + z * std::sqrt(k), 3);
}

// Returns the winding number of a mesh around P from solid angles, which differs from the method used for births.
double winding(const Mesh& mesh, const Vec3f& P)
{
    double angle = 0;
    for (const Mesh::Triangle& t : mesh.triangles) {
        const Vec3d a = (mesh.positions[t[0]] - P).cast<double>(), b = (mesh.positions[t[1]] - P).cast<double>();
        const Vec3d c = (mesh.positions[t[2]] - P).cast<double>();
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle / (4 * pi);
}

MeshPtr both(const MeshPtr& a, const MeshPtr& b, bool turn_b)
{
    auto mesh = std::make_shared<Mesh>(*a);
    const auto first = static_cast<std::int32_t>(mesh->positions.size());
    mesh->positions.insert(mesh->positions.end(), b->positions.begin(), b->positions.end());
    for (Mesh::Triangle t : b->triangles) {
        if (turn_b) std::swap(t[1], t[2]);
        mesh->triangles.push_back(t.array() + first);
    }
    return mesh;
}

}  // namespace

TEST_CASE("births on a mesh fall on its faces in proportion to their areas", "[scatter]")
{
    const MeshPtr box = make_box({1, 2, 5}, Vec3d::Zero());
    constexpr std::size_t n = 120'000;
    std::vector<double> found(12, 0), expected;
    for (const Birthplace& birth : births(scatter_on_surface(box), n)) found[birth.element] += 1;
    for (const Mesh::Triangle& t : box->triangles) {
        const Vec3f a = box->positions[t[0]], b = box->positions[t[1]], c = box->positions[t[2]];
        expected.push_back(n * (b - a).cross(c - a).norm() / 2 / 34);
    }
    CHECK(chi_square(found, expected) < rarely_above(11));
}

TEST_CASE("births within a face are uniform, on its plane, with its normal", "[scatter]")
{
    const MeshPtr mesh = make_mesh({{1, 0, 0}, {0, 2, 0}, {0, 0, 3}}, {{0, 1, 2}});
    const Vec3f normal = Vec3f(6, 3, 2).normalized();
    constexpr std::size_t n = 90'000;
    // Divides the triangle into nine of equal area, by rows of b2 and columns of b1.
    std::vector<double> found(9, 0);
    for (const Birthplace& birth : births(scatter_on_surface(mesh), n)) {
        REQUIRE((birth.b1 >= 0 && birth.b2 >= 0 && birth.b1 + birth.b2 <= 1.000001f));
        REQUIRE_THAT(birth.N, close_to(normal, 1e-6));
        REQUIRE(birth.P.x() + birth.P.y() / 2 + birth.P.z() / 3 == Approx(1).margin(1e-6));
        REQUIRE_THAT(birth.P, close_to(Vec3f{1 - birth.b1 - birth.b2, 2 * birth.b1, 3 * birth.b2}, 1e-6));
        const int row = static_cast<int>(3 * birth.b2), column = static_cast<int>(3 * birth.b1);
        const bool upper = 3 * birth.b1 - column + 3 * birth.b2 - row > 1;
        const int first_of_row[] = {0, 5, 8};
        found[std::min(8, first_of_row[row] + 2 * column + upper)] += 1;
    }
    CHECK(chi_square(found, std::vector<double>(9, n / 9.0)) < rarely_above(8));
}

TEST_CASE("faces without area are never born on", "[scatter]")
{
    std::vector<std::vector<std::int32_t>> faces;
    for (int i = 0; i < 1000; ++i) faces.push_back({0, 1, 1});
    faces.push_back({0, 1, 2});
    const auto scatter = scatter_on_surface(make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, faces));
    for (const Birthplace& birth : births(scatter, 10'000)) REQUIRE(birth.element == 1000);
}

TEST_CASE("the position of a birth depends on the key and its number alone", "[scatter]")
{
    const auto same = [](const Birthplace& a, const Birthplace& b) { return a.P == b.P && a.element == b.element; };
    for (const ScatterPtr& scatter : {scatter_on_surface(make_torus(1, 0.3, 20, Vec3d::Zero())),
                                      scatter_in_volume(make_torus(1, 0.3, 20, Vec3d::Zero())),
                                      scatter_on_surface(ShapePtr(level_set_sphere(1, Vec3d::Zero(), {0.1, 3}))),
                                      scatter_in_volume(ShapePtr(level_set_sphere(1, Vec3d::Zero(), {0.1, 3})))}) {
        constexpr std::size_t n = 20'000;
        const auto all = births(scatter, n);
        std::vector<Birthplace> apart(n);
        const auto place = [&](std::size_t begin, std::size_t end) {
            scatter->place(RandomKey(1, "emit1"), begin, std::span(apart).subspan(begin, end - begin));
        };
        for_each_chunk(n, place, 37);
        CHECK(std::equal(all.begin(), all.end(), apart.begin(), same));
        const auto other_key = births(scatter, n, 2);
        CHECK_FALSE(std::equal(all.begin(), all.end(), other_key.begin(), same));
    }
}

TEST_CASE("births in a box mesh are uniform in its volume", "[scatter]")
{
    const auto scatter = scatter_in_volume(make_box({1, 2, 4}, {5, 0, 0}));
    constexpr std::size_t n = 100'000;
    std::vector<double> found(64, 0);
    for (const Birthplace& birth : births(scatter, n)) {
        const Vec3f x = (birth.P - Vec3f(4.5f, -1, -2)).cwiseQuotient(Vec3f(1, 2, 4));
        REQUIRE((x.minCoeff() >= 0 && x.maxCoeff() <= 1));
        REQUIRE((birth.N.isZero() && birth.element == -1));
        const Eigen::Array3i cell = (4 * x.array()).cast<int>().min(3);
        found[(cell[0] * 4 + cell[1]) * 4 + cell[2]] += 1;
    }
    CHECK(chi_square(found, std::vector<double>(64, n / 64.0)) < rarely_above(63));
}

// In a torus the volume within distance s of its circle is proportional to s², and uniform around its axis. There is
// more volume outside the circle than inside.
TEST_CASE("births in a torus mesh are uniform across its tube and around its axis", "[scatter]")
{
    const auto scatter = scatter_in_volume(make_torus(1, 0.3, 200, Vec3d::Zero()));
    constexpr std::size_t n = 100'000;
    std::vector<double> across(10, 0), around(16, 0);
    double mean_ring = 0;
    for (const Birthplace& birth : births(scatter, n)) {
        const Vec3d P = birth.P.cast<double>();
        const double ring = std::hypot(P.x(), P.z()), s = std::hypot(ring - 1, P.y()) / 0.3;
        REQUIRE(s <= 1.000001);
        across[std::min(9, static_cast<int>(10 * s * s))] += 1;
        around[static_cast<int>(16 * (std::atan2(P.z(), P.x()) / (2 * pi) + 0.5)) % 16] += 1;
        mean_ring += ring / n;
    }
    // The mesh's 60 sides omit 0.2 % of the outermost bin's share, well below the test's resolution.
    CHECK(chi_square(across, std::vector<double>(10, n / 10.0)) < rarely_above(9));
    CHECK(chi_square(around, std::vector<double>(16, n / 16.0)) < rarely_above(15));
    CHECK(mean_ring == Approx(1 + 0.3 * 0.3 / 4).margin(4 * 0.15 / std::sqrt(n)));
}

TEST_CASE("births in a mesh are where its winding number is not 0", "[scatter]")
{
    // Rotated so that no face is axis-aligned.
    const Eigen::Affine3d turn(Eigen::AngleAxisd(0.7, Vec3d(1, 2, 3).normalized()));
    const MeshPtr shell = both(make_box({1, 1, 1}, Vec3d::Zero()), make_box({0.9, 0.9, 0.9}, Vec3d::Zero()), true);
    const MeshPtr overlapping = both(make_box({1, 1, 1}, Vec3d::Zero()), make_box({1, 1, 1}, {0.5, 0.5, 0}), false);
    for (const MeshPtr& mesh : {transformed(shell, turn), transformed(overlapping, turn), shell, overlapping,
                                transformed(make_box({1, 1e-3, 2}, Vec3d::Zero()), turn)}) {
        for (const Birthplace& birth : births(scatter_in_volume(mesh), 5000))
            REQUIRE(std::abs(winding(*mesh, birth.P)) > 0.4);  // 1 or 2; half of that on a face itself
    }
}

TEST_CASE("births in a shell fill it evenly, walls and corners alike", "[scatter]")
{
    const MeshPtr shell = both(make_box({2, 2, 2}, Vec3d::Zero()), make_box({1, 1, 1}, Vec3d::Zero()), true);
    constexpr std::size_t n = 50'000;
    double in_slab = 0;  // the wall at x > 0.5: 0.5 * 4 of 7
    for (const Birthplace& birth : births(scatter_in_volume(shell), n)) in_slab += birth.P.x() > 0.5f;
    CHECK(in_slab / n == Approx(2.0 / 7).margin(4 * std::sqrt(2.0 / 7 * 5 / 7 / n)));
}

TEST_CASE("births in a scanned mesh are inside it", "[scatter]")
{
    const auto path = std::filesystem::path(RAPID_SOURCE_DIR).parent_path() / "shared/assets/meshes/spot.obj";
    if (!std::filesystem::exists(path)) {
        WARN("left out: there is no " << path);
        return;
    }
    const MeshPtr spot = read_mesh(path);
    for (const Birthplace& birth : births(scatter_in_volume(spot), 1000)) REQUIRE(winding(*spot, birth.P) > 0.4);
}

TEST_CASE("births on a level set sphere are on it, uniform, and have outward normals", "[scatter]")
{
    const Vec3f center(1, 2, 3);
    const ShapePtr sphere = level_set_sphere(0.5, center.cast<double>(), {0.05, 3});
    constexpr std::size_t n = 50'000;
    std::vector<double> bands(20, 0), octants(8, 0);
    for (const Birthplace& birth : births(scatter_on_surface(sphere), n)) {
        const Vec3f from_center = birth.P - center;
        REQUIRE(from_center.norm() == Approx(0.5).margin(0.05 * 0.05 / (4 * 0.45)));
        REQUIRE(birth.N.norm() == Approx(1).margin(1e-5));
        REQUIRE(birth.N.dot(from_center) > 0.99 * 0.5);
        bands[std::clamp(static_cast<int>(20 * (0.5 + from_center.y())), 0, 19)] += 1;  // uniform in height, Archimedes
        octants[(from_center.x() > 0) * 4 + (from_center.y() > 0) * 2 + (from_center.z() > 0)] += 1;
    }
    CHECK(chi_square(octants, std::vector<double>(8, n / 8.0)) < rarely_above(7));
    // The surface consists of quads with the size of a voxel, whose area differs locally from the sphere's by up to 1
    // %.
    for (const double found : bands) CHECK(found == Approx(n / 20.0).epsilon(0.07));
}

TEST_CASE("births on a level set are where its distance is zero", "[scatter]")
{
    const LevelSetPtr box = level_set_box({1, 1, 1}, {0.013, 0, 0}, {0.04, 3});
    for (const Birthplace& birth : births(scatter_on_surface(ShapePtr(box)), 20'000)) {
        const Vec3d P = birth.P.cast<double>();
        double phi;
        box->distance({&P, 1}, {&phi, 1}, {});
        REQUIRE(std::abs(phi) < 1e-6);
    }
}

TEST_CASE("births in a level set are inside it, and uniform by volume", "[scatter]")
{
    const ShapePtr sphere = level_set_sphere(1, Vec3d::Zero(), {0.04, 3});
    constexpr std::size_t n = 50'000;
    std::vector<double> shells(10, 0);
    for (const Birthplace& birth : births(scatter_in_volume(sphere), n)) {
        const double r = birth.P.norm();
        REQUIRE(r < 1 + 0.04 * 0.04 / 4);
        shells[std::min(9, static_cast<int>(10 * r * r * r))] += 1;
    }
    CHECK(chi_square(shells, std::vector<double>(10, n / 10.0)) < rarely_above(9));
}

TEST_CASE("sources without area or volume are refused with the numbers", "[scatter]")
{
    const Vec3d o = Vec3d::Zero();
    CHECK_THAT(test::error_of([&] {
                   scatter_on_surface(make_mesh({{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}}));
               }),
               Equals("mesh \"points and faces\" has 1 faces but no area, so it can't emit points"));
    CHECK_THAT(
        test::error_of([&] { scatter_in_volume(make_grid(1, 1, 2, o)); }),
        Equals("mesh \"grid\" encloses no volume: 8 of its edges have an odd number of faces; close it, or use its "
               "surface"));
    CHECK_THAT(
        test::error_of([&] { scatter_in_volume(both(make_grid(1, 1, 2, o), make_grid(1, 1, 2, o), true)); }),
        Equals("mesh \"grid\" encloses no volume: 16 of its edges have an odd number of faces; close it, or use its "
               "surface"));
    CHECK_THAT(test::error_of([&] {
                   scatter_in_volume(make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}));
               }),
               Equals("mesh \"points and faces\" has 2 faces but no volume; use its surface"));
    CHECK_THAT(
        test::error_of([&] {
            scatter_on_surface(make_plane({0, 1, 0}, 0));
        }),
        Equals("a plane has no finite surface that could emit points; use a mesh, a level set, a sphere or a box"));
    CHECK_THAT(
        test::error_of([&] {
            scatter_in_volume(make_plane({0, 1, 0}, 0));
        }),
        Equals(
            "a plane has no finite volume that could emit points; use a closed mesh, a level set, a sphere or a box"));
}
