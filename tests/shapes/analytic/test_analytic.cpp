#include "runtime/shapes/analytic/analytic.h"

#include <cmath>
#include <numbers>

#include "runtime/base/error.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/scatter/scatter.h"
#include "tests/test.h"

namespace rapid {
namespace {

using test::close_to;

struct Answer {
    double phi;
    Vec3d gradient;
};

Answer query(const ShapePtr& shape, const Vec3d& P)
{
    Answer answer;
    shape->distance({&P, 1}, {&answer.phi, 1}, {&answer.gradient, 1});
    double alone;
    shape->distance({&P, 1}, {&alone, 1}, {});
    CHECK(alone == answer.phi);
    return answer;
}

template <class F>
std::string message_of(const F& f)
{
    try {
        f();
        return "";
    } catch (const Error& error) {
        return error.message();
    }
}

TEST_CASE("a plane's points are those with normal · x = offset, for a normal of any length", "[analytic]")
{
    const double length = GENERATE(1e-200, 0.5, 1.0, 3.0, 1e200);
    const Vec3d n = Vec3d(2, 3, 6) / 7;  // a unit vector
    const ShapePtr plane = make_plane(length * n, length * 4);
    const Answer at = query(plane, 5 * n);
    CHECK(at.phi == Approx(1).epsilon(1e-14));
    CHECK_THAT(at.gradient, close_to(n, 1e-15));
}

TEST_CASE("the normal of a plane across an axis is exactly that axis", "[analytic]")
{
    CHECK(query(make_plane({0, 3, 0}, 0), {1, 2, 3}).gradient == Vec3d(0, 1, 0));
    CHECK(query(make_plane({0, 0, -0.1}, 0), {1, 2, 3}).gradient == Vec3d(0, 0, -1));
    CHECK(make_plane({0, 1, 0}, 2)->bounds().max().y() == 2);
    CHECK(make_plane({0, -1, 0}, 2)->bounds().min().y() == -2);
}

TEST_CASE("the distance of a sphere is that of its centre minus its radius", "[analytic]")
{
    const ShapePtr sphere = make_sphere_shape(2, {1, 0, 0});
    CHECK(query(sphere, {4, 0, 4}).phi == 3);
    CHECK(query(sphere, {4, 0, 4}).gradient == Vec3d(0.6, 0, 0.8));
    CHECK(query(sphere, {1, 0, -0.5}).phi == -1.5);
    CHECK(query(sphere, {1, 0, 0}).phi == -2);
    CHECK(query(sphere, {1, 0, 0}).gradient == Vec3d(0, 0, 0));  // at the centre no way out is the nearest
}

TEST_CASE("the distance of a box is that of its nearest face, edge or corner", "[analytic]")
{
    const ShapePtr box = make_box_shape({2, 4, 6}, {10, 0, 0});
    CHECK(query(box, {12, 1, 1}).phi == 1);
    CHECK(query(box, {12, 1, 1}).gradient == Vec3d(1, 0, 0));
    CHECK(query(box, {14, -6, 0}).phi == 5);  // 3 and 4 beyond an edge
    CHECK_THAT(query(box, {14, -6, 0}).gradient, close_to(Vec3d(0.6, -0.8, 0), 1e-15));
    CHECK(query(box, {8, 4, 5}).phi == 3);  // 1, 2 and 2 beyond a corner
    CHECK_THAT(query(box, {8, 4, 5}).gradient, close_to(Vec3d(Vec3d(-1, 2, 2) / 3), 1e-15));
    CHECK(query(box, {10, 1.5, 0}).phi == -0.5);
    CHECK(query(box, {10, 1.5, 0}).gradient == Vec3d(0, 1, 0));
    CHECK(query(box, {11, 0, 0}).phi == 0);
    CHECK(query(box, {11, 0, 0}).gradient == Vec3d(1, 0, 0));
}

TEST_CASE("shapes without a size are refused, with the value given", "[analytic]")
{
    CHECK(message_of([] {
              make_plane({0, 0, 0}, 1);
          }) == "normal of a plane = {0, 0, 0} has no direction; its length must be above 0");
    CHECK(message_of([] {
              make_sphere_shape(0, {0, 0, 0});
          }) == "radius of a sphere = 0 is out of range; it must be above 0");
    CHECK(message_of([] {
              make_box_shape({1, -2, 1}, {0, 0, 0});
          }) == "size of a box = {1, -2, 1} is out of range; each edge must be above 0");
}

TEST_CASE("births on a shape are on it and uniform, and those in it are in it", "[analytic]")
{
    const ShapePtr shape = GENERATE(make_sphere_shape(0.5, {1, 2, 3}), make_box_shape({1, 0.5, 2}, {1, 2, 3}));
    CAPTURE(shape->kind());
    const std::size_t n = 20000;
    std::vector<Birthplace> on(n), in(n);
    scatter_on_surface(shape)->place(RandomKey(1, "emit1"), 0, on);
    scatter_in_volume(shape)->place(RandomKey(1, "emit1"), 0, in);

    Vec3d sum_on = Vec3d::Zero(), sum_in = Vec3d::Zero(), normals = Vec3d::Zero();
    for (std::size_t i = 0; i < n; ++i) {
        const Answer at = query(shape, on[i].P.cast<double>());
        REQUIRE(std::abs(at.phi) < 1e-6);
        REQUIRE(on[i].N.norm() == Approx(1).epsilon(1e-6));
        REQUIRE(query(shape, (on[i].P + 0.01f * on[i].N).cast<double>()).phi == Approx(0.01).margin(1e-6));
        REQUIRE(query(shape, in[i].P.cast<double>()).phi < 1e-6);
        sum_on += on[i].P.cast<double>();
        sum_in += in[i].P.cast<double>();
        normals += on[i].N.cast<double>();
    }
    // The means differ from the centre by at most 5 standard errors of a coordinate that is within 1 of it.
    const double tolerance = 5 / std::sqrt(double(n));
    CHECK_THAT(Vec3d(sum_on / n), close_to(Vec3d(1, 2, 3), tolerance));
    CHECK_THAT(Vec3d(sum_in / n), close_to(Vec3d(1, 2, 3), tolerance));
    CHECK_THAT(Vec3d(normals / n), close_to(Vec3d(0, 0, 0), tolerance));
}

TEST_CASE("half of the births in a ball are within 0.7937 of its radius", "[analytic]")
{
    const std::size_t n = 20000;
    std::vector<Birthplace> in(n);
    scatter_in_volume(make_sphere_shape(2, {0, 0, 0}))->place(RandomKey(2, "emit1"), 0, in);
    std::size_t inner = 0;
    for (const Birthplace& birth : in) inner += birth.P.norm() < 2 * std::cbrt(0.5f);
    CHECK(double(inner) / n == Approx(0.5).margin(5 * 0.5 / std::sqrt(double(n))));
}

TEST_CASE("births fall on the faces of a box in proportion to their areas", "[analytic]")
{
    const std::size_t n = 20000;
    std::vector<Birthplace> on(n);
    scatter_on_surface(make_box_shape({1, 2, 3}, {0, 0, 0}))->place(RandomKey(3, "emit1"), 0, on);
    Vec3d counts = Vec3d::Zero();
    for (const Birthplace& birth : on) counts += birth.N.cwiseAbs().cast<double>();
    // The fractions are 2·3, 3·1 and 1·2 of 11, within 5 standard errors.
    CHECK_THAT(Vec3d(counts / n), close_to(Vec3d(Vec3d(6, 3, 2) / 11), 5 * 0.5 / std::sqrt(double(n))));
}

TEST_CASE("births on a plane are refused, with the shapes that allow them", "[analytic]")
{
    CHECK_THAT(message_of([] {
                   scatter_on_surface(make_plane({0, 1, 0}, 0));
               }),
               Catch::Contains("a plane has no finite surface"));
}

TEST_CASE("the mesh of a shape lies on it", "[analytic]")
{
    const ShapePtr shape = GENERATE(make_sphere_shape(0.5, {1, 2, 3}), make_box_shape({1, 0.5, 2}, {1, 2, 3}));
    const MeshPtr mesh = shape->surface();
    REQUIRE(mesh);
    CHECK(mesh->openness().closed());
    CHECK(mesh->signed_volume() > 0);
    for (const Vec3f& P : mesh->positions) CHECK(std::abs(query(shape, P.cast<double>()).phi) < 1e-6);
}

}  // namespace
}  // namespace rapid
