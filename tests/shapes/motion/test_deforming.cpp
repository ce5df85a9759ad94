#include "runtime/shapes/motion/deforming.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>

#include "runtime/shapes/mesh/mesh_sequence.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Contains;
using rapid::test::close_to;

namespace {

const FrameClock sequence_clock{24, 1};
constexpr double h = 1.0 / 24;

// A mesh sequence with its own files: `place` gives the position of each vertex of `rest` at a frame.
struct Body {
    test::TemporaryFolder folder;
    std::shared_ptr<const AnimatedMesh> mesh;

    Body(const Mesh& rest, int last, const std::function<Vec3d(const Vec3d&, int)>& place)
    {
        std::map<int, std::filesystem::path> files;
        for (int frame = 1; frame <= last; ++frame) {
            std::string text;
            for (const Vec3f& X : rest.positions) {
                const Vec3d P = place(X.cast<double>(), frame);
                text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", P.x(), P.y(), P.z());
            }
            for (const Mesh::Triangle& t : rest.triangles)
                text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
            files[frame] = folder.write(fmt::format("{}.obj", frame), text);
        }
        mesh = std::make_shared<AnimatedMesh>(std::make_shared<MeshSequence>(files, "body.#.obj"), constant_motion({}));
    }

    DeformingLevelSetPtr level_set(double voxel) const
    {
        std::vector<std::string> warnings;
        return std::make_shared<DeformingLevelSet>(mesh, LevelSetOptions{voxel, 3}, warnings);
    }
    Deformation::Interval over(double from, double to, double voxel, const PathOptions& options = {}) const
    {
        return Deformation(level_set(voxel)).over(sequence_clock, from, to, nullptr, options, 0);
    }
};

// A ball that moves 3 m per frame, six times its radius.
constexpr double ball_radius = 0.5, ball_step = 3, voxel = 0.05;
Body fast_ball()
{
    return Body(*make_sphere(ball_radius, 96, Vec3d::Zero()), 6,
                [](const Vec3d& X, int frame) -> Vec3d { return X + Vec3d(ball_step * frame, 0, 0); });
}

double distance_at(const ShapePtr& shape, const Vec3d& P, double time)
{
    double phi = 0;
    shape->distance_at({&P, 1}, {&time, 1}, {&phi, 1}, {});
    return phi;
}

Contact contact_with_deforming(const ShapePtr& shape, const Path& path)
{
    Contact contact;
    shape->first_contact({&path, 1}, {&contact, 1});
    return contact;
}

}  // namespace

TEST_CASE("a ball that moves by more than its size between files meets points when its formula says so", "[deforming]")
{
    const Body ball = fast_ball();
    const ShapePtr shape = ball.over(3, 4, voxel).shape;
    const double speed = ball_step / h, r = GENERATE(0.0, 0.1);
    const double x = GENERATE(9.6, 10.3, 11.4), y = GENERATE(0.0, -0.35);
    const Path path{{x, y, 0.1}, {-20, 0, 0}, {0, 0, 0}, h, r};
    // Solves (x - 20 s - 9 - speed s)² + y² + z² = (R + r)².
    const double half = std::sqrt(std::pow(ball_radius + r, 2) - y * y - 0.01), s = (x - 9 - half) / (speed + 20);
    const Contact contact = contact_with_deforming(shape, path);
    // A level set flattens a sphere by about voxel² / (8 R): 0.6 mm.
    CHECK(contact.time == Approx(s).margin(0.002 / speed));
    CHECK_THAT(contact.vc, close_to(Vec3d(speed, 0, 0), 1e-4));
    const Vec3d n = (path.P + s * path.v - Vec3d(9 + speed * s, 0, 0)).normalized();
    // Within a cell the gradient's components only vary along the other axes, which amounts to half a voxel's turn of
    // the sphere. A facet of the mesh deviates from the sphere's normal by half of its own angle.
    CHECK_THAT(contact.n, close_to(n, 0.5 * voxel / ball_radius + std::numbers::pi / 96));
}

TEST_CASE("at both ends of an interval a deforming level set is bit-identical to that of the mesh", "[deforming]")
{
    const Body ball = fast_ball();
    Deformation deformation(ball.level_set(voxel));
    const ShapePtr first = deformation.over(sequence_clock, 2, 3, nullptr, {}, 0).shape;
    const ShapePtr second = deformation.over(sequence_clock, 3, 4, nullptr, {}, 0).shape;
    std::vector<std::string> warnings;
    const LevelSetPtr still = level_set_from_mesh(ball.mesh->at(sequence_clock, 3), {voxel, 3}, warnings);
    for (const Vec3d& P : {Vec3d(9.5, 0.02, 0.1), Vec3d(9.2, 0.3, -0.3), Vec3d(8.6, 0, 0.2)}) {
        double phi = 0;
        still->distance({&P, 1}, {&phi, 1}, {});
        CHECK(distance_at(first, P, h) == phi);
        CHECK(distance_at(second, P, 0) == phi);
    }
}

TEST_CASE("between frames a ball that grows has the radius and the velocity of its growth", "[deforming]")
{
    // R = 1 + 0.1 (f - 1) is linear, so its spline is exact.
    const Body ball(*make_sphere(1, 96, Vec3d::Zero()), 6,
                    [](const Vec3d& X, int frame) -> Vec3d { return (1 + 0.1 * (frame - 1)) * X; });
    const ShapePtr shape = ball.over(3, 4, voxel).shape;
    for (const double t : {0.0, 0.3, 0.5, 0.9, 1.0})
        for (const double above : {-0.08, 0.0, 0.02, 0.4, 5.0}) {
            const double R = 1.2 + 0.1 * t;
            const Vec3d P = (R + above) * Vec3d(1, 2, -2) / 3;
            CAPTURE(t, above);
            const double phi = distance_at(shape, P, t * h);
            if (above < 0.1)
                CHECK(phi == Approx(above).margin(2e-3));
            else
                CHECK((phi > 0.1 && phi <= above + 1e-3));  // a lower bound
            CHECK_THAT(shape->velocity_at(P, t * h), close_to(Vec3d(0.1 / h * Vec3d(1, 2, -2) / 3), 0.05));
        }
}

TEST_CASE("a point deep in a deforming body has the nearest direction out", "[deforming]")
{
    const Body box(*make_box({2, 2, 0.8}, {0, 0, 0}), 4,
                   [](const Vec3d& X, int frame) -> Vec3d { return X + Vec3d(0.1 * frame, 0, 0); });
    const ShapePtr shape = box.over(2, 3, voxel).shape;
    const double begin = GENERATE(0.0, 0.01);
    const Path path{{0.2, 0.1, 0.1}, {0, 0, 0}, {0, -9.81, 0}, h - begin, 0.02, begin};
    const Contact contact = contact_with_deforming(shape, path);
    CHECK(contact.time == 0);
    CHECK(contact.depth == Approx(0.32).margin(0.01));
    CHECK_THAT(contact.n, close_to(Vec3d(0, 0, 1), 1e-6));
}

TEST_CASE("a path that leaves a deforming body meets it again where it reaches it, even within the same voxel",
          "[deforming]")
{
    const Body torus(*make_torus(0.8, 0.25, 96, {0, 0, 0}), 4,
                     [](const Vec3d& X, int frame) -> Vec3d { return (1 + 1e-3 * frame) * X; });
    const ShapePtr shape = torus.over(2, 3, voxel).shape;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> in(-1, 1);
    int again = 0;
    for (int i = 0; i < 2000; ++i) {
        const Vec3d to = 100 * Vec3d(in(random), 0, in(random)).normalized();
        const Path inwards{{0, 0, 0}, to - Vec3d(0, 10 * in(random), 0), Vec3d::Zero(), h / 2, 0};
        const Contact first = contact_with_deforming(shape, inwards);
        REQUIRE(first.time < inwards.duration);
        const double away = 100 * std::pow(10, 1.5 * in(random)-2.5);
        const Vec3d across = first.n.cross(Vec3d::UnitY()).normalized();
        const Path out{inwards.P + first.time * inwards.v,
                       first.vc + 100 * across + away * first.n,
                       Vec3d::Zero(),
                       h / 2,
                       0,
                       first.time};
        const Contact second = contact_with_deforming(shape, out);
        CAPTURE(i, second.time, away);
        REQUIRE(second.time < out.duration);
        REQUIRE(second.n.dot(out.v - second.vc) < 0.1);
        again += second.time < 5e-4;
    }
    CHECK(again > 100);
}

TEST_CASE("a paddle of files that turns 40 degrees a frame lets no point through", "[deforming]")
{
    const double step = 40 * std::numbers::pi / 180;
    const auto turned = [&](const Vec3d& X, double frame) -> Vec3d {
        return Eigen::AngleAxisd(step * frame, Vec3d::UnitZ()) * X;
    };
    const Body paddle(*make_box({2, 0.16, 1}, {1.2, 0, 0}), 6,
                      [&](const Vec3d& X, int frame) { return turned(X, frame); });
    const ShapePtr shape = paddle.over(3, 4, 0.04).shape;
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> u(0, 1);
    for (int i = 0; i < 300; ++i) {
        // Starts between the two positions of its face, well within its ends.
        const double r = 0.5 + 1.4 * u(random), part = 0.2 + 0.6 * u(random), z = 0.8 * (u(random) - 0.5);
        const Path path{turned({r, 0, z}, 3 + part), {0, 0, 0.1}, {0, -9.81, 0}, h, 0};
        CAPTURE(i, r, part, z);
        const Contact contact = contact_with_deforming(shape, path);
        REQUIRE(contact.time != Contact::none);
        if (contact.depth > 0) continue;  // it started inside the paddle
        // A spline through steps of 40 degrees has a velocity error of 3 % (numerics.md: second order).
        const Vec3d at = path.P + contact.time * path.v + 0.5 * contact.time * contact.time * path.a;
        CHECK_THAT(contact.vc, close_to(Vec3d(step / h * Vec3d::UnitZ().cross(at)), 0.08 * step / h * r));
        CHECK(contact.n.dot(contact.vc) > 0);
    }
}

TEST_CASE("a deforming body that jumps sweeps nothing along, and says so; cut = {} says that it is no jump",
          "[deforming]")
{
    const Body ball(*make_sphere(0.5, 48, Vec3d::Zero()), 8, [](const Vec3d& X, int frame) -> Vec3d {
        return X + Vec3d(0.01 * frame + (frame > 4 ? 10 : 0), 0, 0);
    });
    const Path between{{5, 0, 0}, {0, 0, 0}, {0, 0, 0}, h, 0};
    const Deformation::Interval jump = ball.over(4, 5, voxel);
    REQUIRE(jump.jump);
    CHECK(jump.jump->distance == Approx(10.01).epsilon(1e-3));
    CHECK(contact_with_deforming(jump.shape, between).time == Contact::none);
    // It arrives with the velocity with which it continues.
    CHECK_THAT(jump.shape->velocity_at({10.5, 0, 0}, 0.5 * h), close_to(Vec3d(0.01 / h, 0, 0), 1e-4));

    PathOptions no_cut;
    no_cut.cuts.emplace();
    const Deformation::Interval sweep = ball.over(4, 5, voxel, no_cut);
    CHECK_FALSE(sweep.jump);
    CHECK(contact_with_deforming(sweep.shape, between).time != Contact::none);
}

TEST_CASE("before and after its files a body is at rest, and built once", "[deforming]")
{
    const Body ball = fast_ball();
    Deformation deformation(ball.level_set(voxel));
    const ShapePtr before = deformation.over(sequence_clock, -1, 0, nullptr, {}, 0).shape;
    CHECK_FALSE(before->moves());
    CHECK(deformation.over(sequence_clock, 0, 1, nullptr, {}, 0).shape == before);
    CHECK(deformation.over(sequence_clock, 1, 2, nullptr, {}, 0).shape->moves());
    CHECK_FALSE(deformation.over(sequence_clock, 20, 21, nullptr, {}, 0).shape->moves());
}

TEST_CASE("users of a deforming level set share those of whole frames, as far as their bands reach", "[deforming]")
{
    const Body ball = fast_ball();
    const DeformingLevelSetPtr body = ball.level_set(voxel);
    Deformation one(body), other(body), wide(body);
    const Deformation::Interval interval = one.over(sequence_clock, 2, 3, nullptr, {}, 0);
    other.over(sequence_clock, 2, 3, nullptr, {}, 0);
    CHECK(one.at_end() == other.at_end());
    wide.over(sequence_clock, 2, 3, nullptr, {}, 5 * voxel);
    CHECK(wide.at_end() != one.at_end());
    CHECK(wide.at_end()->band() >= 5 * voxel * (1 - 1e-6));
    const auto moved = body->transformed(constant_motion({Vec3d(0, 1, 0), Eigen::Quaterniond::Identity(), 1}));
    CHECK(moved->at(sequence_clock, 3, 0)->bounds().center().y() > 0.9);
    CHECK(std::abs(body->at(sequence_clock, 3, 0)->bounds().center().y()) < 0.1);
}

TEST_CASE("parts of a frame are parts of its curve", "[deforming]")
{
    const Body ball = fast_ball();
    const ShapePtr whole = ball.over(3, 4, voxel).shape, half = ball.over(3.5, 4, voxel).shape;
    const Path path{{11.4, 0, 0.1}, {-1, 0, 0}, {0, 0, 0}, h, 0};
    const Path later{{11.4 - 0.5 * h, 0, 0.1}, {-1, 0, 0}, {0, 0, 0}, 0.5 * h, 0};
    const double s = contact_with_deforming(whole, path).time;
    CHECK(contact_with_deforming(half, later).time == Approx(s - 0.5 * h).margin(0.002 * h));
}
