#include "runtime/shapes/level_set/level_set_tools.h"

#include <cmath>
#include <numbers>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/placed.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Contains;

namespace {

using std::numbers::pi;
std::vector<std::string> no_warnings;

LevelSetPtr ball(double radius, const Vec3d& center, double voxel = 0.04)
{
    return level_set_sphere(radius, center, {voxel, 3});
}

double volume_of(const LevelSetPtr& shape) { return shape->surface()->signed_volume(); }
double area_of(const LevelSetPtr& shape) { return shape->surface()->area(); }
double ball_volume(double r) { return 4.0 / 3 * pi * r * r * r; }

double distance(const Shape& shape, const Vec3d& P)
{
    double phi = 0;
    shape.distance({&P, 1}, {&phi, 1}, {});
    return phi;
}

// Returns the volume of the lens of two balls of radius r with centres at distance d.
double lens_volume(double r, double d) { return pi / 12 * (4 * r + d) * (2 * r - d) * (2 * r - d); }

}  // namespace

TEST_CASE("the union, intersection and difference of two balls have the volumes of their lens", "[level_set]")
{
    const double r = 1, d = 0.9;
    const LevelSetPtr a = ball(r, {0, 0, 0}), b = ball(r, {d, 0, 0});
    const double lens = lens_volume(r, d), one = ball_volume(r);
    std::vector<std::string> warnings;
    // The surface mesh cuts creases by a fraction of a voxel, and lies inside a ball by voxel² / (8 r).
    CHECK(volume_of(combine_level_sets(a, b, Combine::Union, warnings)) == Approx(2 * one - lens).epsilon(0.003));
    CHECK(volume_of(combine_level_sets(a, b, Combine::Intersect, warnings)) == Approx(lens).epsilon(0.006));
    CHECK(volume_of(combine_level_sets(a, b, Combine::Subtract, warnings)) == Approx(one - lens).epsilon(0.006));
    CHECK(warnings.empty());
}

TEST_CASE("a combination has the distances of its parts where only one of them is near", "[level_set]")
{
    const LevelSetPtr both =
        combine_level_sets(ball(1, {0, 0, 0}), ball(0.5, {1.1, 0, 0}), Combine::Union, no_warnings);
    CHECK(distance(*both, {-1.05, 0, 0}) == Approx(0.05).margin(1e-3));
    CHECK(distance(*both, {1.63, 0, 0}) == Approx(0.03).margin(1e-3));
    CHECK(distance(*both, {0.8, 0, 0}) < 0);

    const LevelSetPtr wide = both->with_band(0.5);
    CHECK(wide->band() >= 0.5);
    CHECK(distance(*wide, {-1.4, 0, 0}) == Approx(0.4).margin(2e-3));
}

TEST_CASE("shifted voxels are resampled, and other sizes are with a warning", "[level_set]")
{
    const LevelSetPtr a = ball(1, {0, 0, 0}, 0.05);
    const LevelSetPtr shifted = move_level_set(ball(1, {0, 0, 0}, 0.05), {{0.913, 0, 0}});
    std::vector<std::string> warnings;
    const double lens = lens_volume(1, 0.913);
    CHECK(volume_of(combine_level_sets(a, shifted, Combine::Intersect, warnings)) == Approx(lens).epsilon(0.01));
    CHECK(warnings.empty());
    // Resampling uses the mesh of the coarse ball, which loses 1.2 voxel² / r² of its volume.
    const LevelSetPtr coarse = ball(1, {0.913, 0, 0}, 0.08);
    CHECK(volume_of(combine_level_sets(a, coarse, Combine::Intersect, warnings)) ==
          Approx(lens).epsilon(0.006 + 1.2 * 0.08 * 0.08));
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Contains("the second level set has a voxel of 0.08 m and the first of 0.05 m"));
}

TEST_CASE("voxels far from the origin, moved by whole voxels, combine without resampling", "[level_set]")
{
    const double far = 2000;  // 50,000 voxels
    const LevelSetPtr a = ball(1, {far, 0, 0}), b = ball(1, {far + 0.9, 0, 0});
    CHECK(volume_of(combine_level_sets(a, b, Combine::Intersect, no_warnings)) ==
          Approx(lens_volume(1, 0.9)).epsilon(0.006));
}

TEST_CASE("an offset ball is a ball with a radius larger or smaller by the offset", "[level_set]")
{
    const double by = GENERATE(-0.5, -0.1, 0.02, 0.3, 1.0);
    CAPTURE(by);
    const LevelSetPtr grown = offset_level_set(ball(1, {0.3, 0, 0}), by), expected = ball(1 + by, {0.3, 0, 0});
    // The two meshes have the same error, and the band of the grown one has the error of single precision.
    CHECK(volume_of(grown) == Approx(volume_of(expected)).epsilon(1e-5));
    CHECK(area_of(grown) == Approx(area_of(expected)).epsilon(1e-5));
    CHECK(volume_of(grown) == Approx(ball_volume(1 + by)).epsilon(1.2 * std::pow(0.04 / (1 + by), 2)));
    CHECK(distance(*grown, {0.3, 1 + by + 0.03, 0}) == Approx(0.03).margin(1e-3));
    CHECK(grown->band() == Approx(0.12));
}

TEST_CASE("smoothing shrinks a ball as diffusion does, keeps a box's faces and rounds its corners", "[level_set]")
{
    // A Gaussian with variance s² along each axis adds s²/2 times the Laplacian, which is 2/r for the distance. It
    // consists of four means over three voxels with a variance of 2/3 voxel² each.
    const double variance = 2 * 4 * 2.0 / 3 * 0.04 * 0.04;
    CHECK(distance(*smooth_level_set(ball(1, {0, 0, 0}), 1, 2), {0, 1, 0}) == Approx(variance).epsilon(0.05));

    const LevelSetPtr box = level_set_box({1, 1, 1}, {0, 0, 0}, {0.04, 3});
    const LevelSetPtr round = smooth_level_set(box, 1, 2);
    CHECK(distance(*round, {0.5, 0, 0}) == Approx(0).margin(1e-3));
    CHECK(distance(*box, {0.48, 0.48, 0.48}) == Approx(-0.02).margin(1e-5));  // at a voxel, not interpolated
    CHECK(distance(*round, {0.48, 0.48, 0.48}) > 0.01);
}

TEST_CASE("a resampled level set is the same surface on other voxels", "[level_set]")
{
    const double voxel = GENERATE(0.02, 0.06, 0.1);
    const LevelSetPtr other = resample_level_set(ball(1, {0, 0.2, 0}), voxel);
    CHECK(other->voxel() == Approx(voxel));
    CHECK(other->band() == Approx(3 * voxel));
    // The mesh used for resampling lies inside the ball by a fraction of voxel² / r.
    CHECK(volume_of(other) == Approx(volume_of(ball(1, {0, 0.2, 0}, voxel))).epsilon(1.2 * 0.04 * 0.04));
}

TEST_CASE("moving and scaling a level set moves and scales its voxels, and keeps its values", "[level_set]")
{
    const LevelSetPtr moved = move_level_set(ball(1, {0, 0, 0}), {{5, -2, 1}, Eigen::Quaterniond::Identity(), 2});
    CHECK(moved->voxel() == Approx(0.08));
    CHECK(distance(*moved, {5, 0.1, 1}) == Approx(0.1).margin(1e-4));
    CHECK(volume_of(moved) == Approx(ball_volume(2)).epsilon(0.003));
    CHECK(distance(*moved->with_band(1), {5, 0.9, 1}) == Approx(0.9).margin(1e-3));
}

TEST_CASE("a rotated level set is queried in its own frame, and combines like any other", "[level_set]")
{
    const Eigen::Quaterniond eighth(Eigen::AngleAxisd(pi / 4, Vec3d::UnitZ()));
    const LevelSetPtr box = level_set_box({1, 1, 1}, {0, 0, 0}, {0.02, 3});
    const LevelSetPtr turned = move_level_set(box, {{0, 0, 0}, eighth});
    CHECK(distance(*turned, {0.46 * std::sqrt(2.0), 0, 0}) == Approx(-0.04).margin(1e-5));  // at one of its own voxels
    CHECK(distance(*turned, {0, 0, 0.53}) == Approx(0.03).margin(1e-4));
    CHECK(turned->active_voxels() == box->active_voxels());

    // Their intersection is a prism over a regular octagon of inner radius 1/2.
    const double octagon = 8 * 0.25 * std::tan(pi / 8);
    CHECK(volume_of(combine_level_sets(box, turned, Combine::Intersect, no_warnings)) == Approx(octagon).epsilon(0.01));
}

TEST_CASE("a level set of points is the union of their balls", "[level_set]")
{
    const double r = 0.5, d = 0.6;
    const std::vector<Vec3f> P{{0, 0, 0}, {static_cast<float>(d), 0, 0}, {5, 0, 0}};
    const std::vector<float> radius{0.5f};
    const LevelSetPtr balls = level_set_from_points(P, radius, {0.03, 3});
    CHECK(volume_of(balls) == Approx(3 * ball_volume(r) - lens_volume(r, d)).epsilon(0.005));
    // Between voxels the error of the field is at most voxel²/8 times the sum of its second derivatives, 2/r.
    const double interpolated = 0.03 * 0.03 / 8 * 2 / r;
    CHECK(distance(*balls, {5, 0.55, 0}) == Approx(0.05).margin(interpolated));
    CHECK(distance(*balls->with_band(0.3), {5, 0.75, 0}) == Approx(0.25).margin(interpolated));

    const std::vector<float> radii{0.5f, 0.25f, 1.0f};
    CHECK(distance(*level_set_from_points(P, radii, {0.03, 3}), {5, 1.05, 0}) == Approx(0.05).margin(interpolated));
}

TEST_CASE("a moved level set is written and read at its new position", "[level_set]")
{
    const test::TemporaryFolder folder;
    const auto path = folder / "turned.vdb";
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.5, Vec3d(1, 1, 0).normalized()));
    move_level_set(level_set_box({1, 0.5, 0.7}, {0, 0, 0}, {0.03, 3}), {{3, 2, 1}, turn})->write(path, "turned");
    const LevelSetPtr back = read_level_set(path, "turned");
    // Resampling cuts its edges, 8.8 m in all, by a fraction of a voxel.
    CHECK(volume_of(back) == Approx(0.35).margin(8.8 * 0.03 * 0.03));
    CHECK(distance(*back, Vec3d(3, 2, 1) + turn * Vec3d(0.55, 0, 0)) == Approx(0.05).margin(2e-3));
}

TEST_CASE("an operation that leaves nothing, or can't be built, is refused with the numbers", "[level_set][extreme]")
{
    const LevelSetPtr a = ball(1, {0, 0, 0});
    CHECK_THAT(test::error_of([&] {
                   combine_level_sets(a, ball(1, {5, 0, 0}), Combine::Intersect, no_warnings);
               }),
               Contains("nothing is left of the intersection; the two do not overlap"));
    CHECK_THAT(test::error_of([&] {
                   combine_level_sets(a, ball(2, {0, 0, 0}), Combine::Subtract, no_warnings);
               }),
               Contains("nothing is left of the difference; the second covers the first"));
    CHECK_THAT(test::error_of([&] { offset_level_set(a, -1.2); }),
               Contains("nothing is left of the level set 1.2 m inwards"));
    CHECK_THAT(test::error_of([&] { offset_level_set(a, -1e30); }), Contains("nothing is left"));
    CHECK_THAT(test::error_of([&] { offset_level_set(a, 1e6); }), Contains("voxel"));
    CHECK_THAT(test::error_of([&] { offset_level_set(a, NAN); }), Contains("must be finite"));
    CHECK_THAT(test::error_of([&] { resample_level_set(a, 1e-6); }), Contains("a voxel of at least"));
    CHECK_THAT(test::error_of([&] { resample_level_set(a, 10); }), Contains("vanishes with voxel = 10 m"));
    CHECK_THAT(test::error_of([&] { resample_level_set(a, 0); }), Contains("voxel = 0 m is out of range"));
    const std::vector<Vec3f> P{{0, 0, 0}, {1e9f, 0, 0}};
    CHECK_THAT(test::error_of([&] { level_set_from_points({}, {}, {}); }),
               Contains("needs points, and there are none"));
    CHECK_THAT(test::error_of([&] {
                   level_set_from_points(P, std::vector<float>{0.1f}, {0.1, 3});
               }),
               Contains("point 0 has the radius 0.1 m; with voxel = 0.1 m it must be at least 1.5 voxels"));
    CHECK_THAT(test::error_of([&] {
                   level_set_from_points(P, std::vector<float>{1.0f}, {0.1, 3});
               }),
               Contains("a voxel of at least"));
}
