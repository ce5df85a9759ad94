#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/mesh/mesh_sequence.h"
#include "runtime/shapes/motion/animated.h"
#include "tests/files/temporary_folder.h"
#include "tests/operators/node_test.h"

namespace rapid {

using namespace test;
using Catch::Matchers::Contains;

namespace {

constexpr double fps = 24;

class Formula final : public Motion {
public:
    explicit Formula(std::function<Pose(const Frame&)> pose) : pose_(std::move(pose)) {}
    Pose at(const Frame& frame) const override { return pose_(frame); }
    FrameRange range() const override { return {-INFINITY, INFINITY}; }

private:
    std::function<Pose(const Frame&)> pose_;
};

MotionPtr places(std::function<Vec3d(const Frame&)> place)
{
    return std::make_shared<Formula>([place = std::move(place)](const Frame& frame) { return Pose{place(frame)}; });
}

// A mesh that is practically a point.
MeshPtr speck() { return make_mesh({{0, 0, 0}, {1e-6f, 0, 0}, {0, 0, 1e-6f}}, {{0, 1, 2}}); }
constexpr double speck_size = 2e-6;

Value moved(const MeshPtr& mesh, const MotionPtr& motion)
{
    return ObjectPtr(std::make_shared<AnimatedMesh>(mesh, motion));
}

// A mesh with generated files: its vertices are those of `rest` times the factor of the frame.
struct GrowingMesh {
    TemporaryFolder folder;
    std::shared_ptr<const AnimatedMesh> mesh;

    GrowingMesh(const Mesh& rest, int first, int last, const std::function<double(int)>& factor)
    {
        std::map<int, std::filesystem::path> files;
        for (int frame = first; frame <= last; ++frame) {
            std::string text;
            for (const Vec3f& P : rest.positions) {
                const Vec3d Q = factor(frame) * P.cast<double>();
                text += fmt::format("v {:.9} {:.9} {:.9}\n", Q.x(), Q.y(), Q.z());
            }
            for (const Mesh::Triangle& t : rest.triangles)
                text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
            files[frame] = folder.write(fmt::format("{}.obj", frame), text);
        }
        mesh = std::make_shared<AnimatedMesh>(std::make_shared<MeshSequence>(files, "#.obj"), constant_motion({}));
    }
};

}  // namespace

TEST_CASE("an emitter on a circle emits an even stream without a seam between frames", "[emit]")
{
    const double radius = 2, turn = 0.3, rate = 977;  // rad per frame
    const auto circle = [=](double time) {
        const double at = turn * time * fps;
        return Vec3d(radius * std::cos(at), radius * std::sin(at), 0);
    };
    NodeTest emit("emit", {{"source", moved(speck(), places([&](const Frame& f) { return circle(f.time); }))},
                           {"rate", rate},
                           {"birth", "even"}});
    // The first interval has a one-sided beginning, with a larger error.
    double off = 0, slip = 0, shortest = 1e9, longest = 0;
    Vec3d last = Vec3d::Zero();
    std::int64_t k = 0;
    for (std::int64_t frame = 2; frame <= 60; ++frame) {
        const PointSet born = emit(frame);
        for (std::size_t i = 0; i < born.size(); ++i, ++k) {
            const Vec3d P = born.P()[i].cast<double>(), there = circle(double(k + 1) / rate);
            const Vec3d tangent = turn * fps * Vec3d(-there.y(), there.x(), 0);
            if (frame > 2) {
                off = std::max(off, (P - there).norm());
                slip = std::max(slip, (born.v()[i].cast<double>() - tangent).norm());
                shortest = std::min(shortest, (P - last).norm());
                longest = std::max(longest, (P - last).norm());
            }
            last = P;
        }
    }
    const double even = 2 * radius * std::sin(turn * fps / rate / 2);
    CHECK(k == static_cast<std::int64_t>(rate * 59 / 24));
    CHECK(off < radius * std::pow(turn, 3) / 40);
    CHECK(slip < radius * turn * fps * turn * turn / 5);
    CHECK(longest < even * (1 + turn * turn / 4));
    CHECK(shortest > even * (1 - turn * turn / 4));
    CHECK(emit.warnings.empty());
}

TEST_CASE(
    "a uniform or accelerated emitter bears points exactly where it is, with its velocity, from the first frame on",
    "[emit]")
{
    const Vec3d P0(1, 2, 3), v(30, -4, 0), a = GENERATE(Vec3d(0, 0, 0), Vec3d(10, 300, -7));
    const auto path = [=](double t) -> Vec3d { return P0 + t * v + 0.5 * t * t * a; };
    NodeTest emit("emit", {{"source", moved(speck(), places([&](const Frame& f) { return path(f.time); }))},
                           {"rate", 500.0},
                           {"birth", "even"},
                           {"inherit_velocity", 0.5}});
    double off = 0, slip = 0;
    for (std::int64_t k = 0, frame = 2; frame <= 10; ++frame) {
        const PointSet born = emit(frame);
        for (std::size_t i = 0; i < born.size(); ++i, ++k) {
            const double t = double(k + 1) / 500;
            off = std::max(off, (born.P()[i].cast<double>() - path(t)).norm());
            slip = std::max(slip, (born.v()[i].cast<double>() - 0.5 * (v + t * a)).norm());
        }
    }
    CHECK(off < speck_size + 4e-6);  // due to single precision at 30 m
    CHECK(slip < 1e-5);
}

TEST_CASE("an impulse at the first frame is where the emitter begins, with the velocity that it begins with", "[emit]")
{
    NodeTest emit("emit",
                  {{"source", moved(speck(), places([](const Frame& f) { return Vec3d(1 + 6 * f.time, 0, 0); }))},
                   {"impulse", list({4.0})}});
    const PointSet born = emit.at_start();
    REQUIRE(born.size() == 4);
    CHECK_THAT(born.P()[2], close_to(Vec3f(1, 0, 0), 2 * speck_size));
    CHECK_THAT(born.v()[2], close_to(Vec3f(6, 0, 0), 1e-5));
}

TEST_CASE("motion = \"linear\" is the straight line between two frames, \"none\" the place at the end, at rest",
          "[emit]")
{
    const auto at = [](double frame) { return Vec3d(frame * frame, 0, 0); };
    const auto born_by = [&](const char* motion) {
        return NodeTest("emit", {{"source", moved(speck(), places([&](const Frame& f) { return at(f.number); }))},
                                 {"count", 4.0},
                                 {"birth", "even"},
                                 {"motion", motion}})(5);
    };
    const PointSet linear = born_by("linear"), none = born_by("none");
    for (int i = 0; i < 4; ++i) {
        const double t = (i + 1) / 4.0;
        CHECK_THAT(linear.P()[i], close_to(Vec3f(static_cast<float>(16 + 9 * t), 0, 0), 2 * speck_size));
        CHECK_THAT(linear.v()[i], close_to(Vec3f(216, 0, 0), 1e-4));
        CHECK_THAT(none.P()[i], close_to(Vec3f(25, 0, 0), 2 * speck_size));
        CHECK(none.v()[i] == Vec3f::Zero());
    }
}

TEST_CASE("nothing is born along a jump, which is reported; cut says so, or that there is none", "[emit]")
{
    const auto jumps_at_9 = [](const Frame& f) { return Vec3d(0.1 * f.number + (f.number >= 9 ? 50 : 0), 0, 0); };
    const Arguments arguments{{"source", moved(speck(), places(jumps_at_9))}, {"count", 10.0}, {"birth", "even"}};
    const auto run = [&](std::optional<Value> cut) {
        Arguments with_cut = arguments;
        if (cut) with_cut["cut"] = *cut;
        NodeTest emit("emit", with_cut);
        std::vector<double> x;
        for (std::int64_t frame = 2; frame <= 20; ++frame) {
            const PointSet born = emit(frame);
            for (std::size_t i = 0; i < born.size(); ++i) x.push_back(double(born.P()[i].x()));
        }
        return std::pair(x, emit.warnings);
    };
    const auto between = [](const std::vector<double>& x) {
        return std::count_if(x.begin(), x.end(), [](double at) { return at > 1.2 && at < 50; });
    };
    const auto found = run(std::nullopt), said = run(list({9.0})), denied = run(list({}));
    CHECK(between(found.first) == 0);
    CHECK(between(said.first) == 0);
    CHECK(between(denied.first) > 5);
    CHECK(said.second.empty());
    CHECK(denied.second.empty());
    REQUIRE(found.second.size() == 1);
    CHECK_THAT(found.second[0],
               Contains("the source jumps by 50.1 m to frame 9, 501 times as far as in the neighbouring frames"));

    // The stream itself has no gap: 1/100 m between births, except for the jump.
    double widest = 0;
    for (std::size_t i = 1; i < found.first.size(); ++i)
        if (found.first[i] - found.first[i - 1] < 40)
            widest = std::max(widest, std::abs(found.first[i] - found.first[i - 1] - 0.01));
    CHECK(widest < 2 * 3.9e-6 + speck_size);  // two positions rounded at 51 m
}

TEST_CASE("a deforming mesh carries births along the paths of its faces, with their velocity and normals", "[emit]")
{
    // Grows by a tenth of its size at frame 0 per frame.
    const MeshPtr ball = make_sphere(1, 12, Vec3d::Zero());
    const GrowingMesh growing(*ball, 1, 12, [](int frame) { return 1 + 0.1 * frame; });
    const std::string from = GENERATE("surface", "points", "volume");
    CAPTURE(from);
    NodeTest emit("emit", {{"source", ObjectPtr(growing.mesh)}, {"count", 400.0}, {"birth", "even"}, {"from", from}});
    const PointSet born = emit(6);
    double slip = 0, outside = 0, inside = 1e9;
    for (std::size_t i = 0; i < born.size(); ++i) {
        const Vec3d P = born.P()[i].cast<double>();
        const double size = 1 + 0.1 * (5 + double(i + 1) / 400);
        // Each position of a uniformly growing body moves in proportion to its distance.
        slip = std::max(slip, (born.v()[i].cast<double>() - P * (0.1 / size) * fps).norm());
        outside = std::max(outside, P.norm() / size);
        inside = std::min(inside, P.norm() / size);
    }
    CHECK(slip < 2e-5);
    CHECK(outside < 1 + 1e-6);
    if (from != "volume") CHECK(inside > 0.9);  // for a sphere with 12 divisions
    if (from == "volume") CHECK(inside < 0.5);

    // It is at rest after its last file.
    const PointSet later = emit(20);
    CHECK(later.v()[7] == Vec3f::Zero());
}

TEST_CASE("speed goes along the normal that a turning source has at the time of birth", "[emit]")
{
    const double turn = 0.2;
    const auto motion = std::make_shared<Formula>([&](const Frame& f) {
        return Pose{{0, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(turn * f.number, Vec3d::UnitZ()))};
    });
    const MeshPtr facing_x = make_mesh({{1, 0, 0}, {1, 1e-3f, 0}, {1, 0, 1e-3f}}, {{0, 1, 2}});
    NodeTest emit("emit", {{"source", moved(facing_x, motion)},
                           {"count", 4.0},
                           {"birth", "even"},
                           {"speed", 3.0},
                           {"inherit_velocity", 0.0}});
    const PointSet born = emit(9);
    for (int i = 0; i < 4; ++i) {
        const double at = turn * (8 + (i + 1) / 4.0);
        CHECK_THAT(born.v()[i],
                   close_to(Vec3f(3 * float(std::cos(at)), 3 * float(std::sin(at)), 0), 3 * turn * turn / 20));
    }
}

TEST_CASE("a moving sphere emits points on its surface, wherever it is", "[emit]")
{
    const MotionPtr motion = keyed_motion({{1, {{0, 0, 0}}}, {11, {{20, 0, 0}}}});
    const ObjectPtr sphere = std::make_shared<AnimatedShape>(make_sphere_shape(0.5, {0, 1, 0}), motion);
    NodeTest emit("emit", {{"source", sphere}, {"count", 100.0}, {"birth", "even"}});
    const PointSet born = emit(5);
    for (std::size_t i = 0; i < born.size(); ++i) {
        const Vec3d center(2 * (3 + double(i + 1) / 100), 1, 0);
        CHECK((born.P()[i].cast<double>() - center).norm() == Approx(0.5).margin(1e-5));
        CHECK_THAT(born.v()[i], close_to(Vec3f(48, 0, 0), 1e-4));
    }
}

TEST_CASE("age can be an attribute of the source", "[emit]")
{
    PointSet from = points_at({{0, 0, 0}, {1, 0, 0}});
    from.set("delay", Column<float>(std::span<const float>(std::vector<float>{0.01f, 0.5f})));
    PointSet requested;
    requested.add(*known_attribute("age"));
    NodeTest emit("emit",
                  {{"source", ObjectPtr(source_of(from))}, {"count", 2.0}, {"age", Value(AttributeRef{"delay"})}});
    const PointSet born = emit(2, requested);
    CHECK(values_of<float>(born, "dt") == std::vector<float>{0.01f, static_cast<float>(1 / fps)});
    CHECK(values_of<float>(born, "age")[1] == Approx(0.5 - 1 / fps));

    const auto refusal = [&](const PointSet& points) {
        return error_of([&] {
            NodeTest("emit",
                     {{"source", ObjectPtr(source_of(points))}, {"count", 2.0}, {"age", Value(AttributeRef{"delya"})}});
        });
    };
    CHECK(refusal(from) ==
          "age = rapid.attr \"delya\": the source has no float with this name; did you mean \"delay\"?");
    from.set("delya", Column<float>(2, -1.0f));
    CHECK(refusal(from) == "age = rapid.attr \"delya\": point 0 of the source has -1; an age must be at least 0");
}

TEST_CASE("births on a moving mesh are the same bits on any number of threads", "[emit]")
{
    const auto source = moved(make_torus(1, 0.2, 20, Vec3d::Zero()),
                              places([](const Frame& f) { return Vec3d(std::sin(f.time), f.time, 0); }));
    const auto born_on = [&](int threads) {
        NodeTest emit("emit", {{"source", source}, {"rate", 1e6}});
        PointSet born;
        tbb::task_arena(threads).execute([&] { born = emit(2); });
        return std::pair(values_of<Vec3f>(born, "P"), values_of<Vec3f>(born, "v"));
    };
    CHECK(born_on(1) == born_on(4));
}

// Returns a sequence of two files. The first face shrinks from the side 1 to 0.2 while the second grows from 0.2 to 1.
// delays: values of the attribute delay at the corners of each face.
ObjectPtr shrinking_and_growing(const TemporaryFolder& folder, double first_delay, double second_delay)
{
    std::map<int, std::filesystem::path> files;
    for (const int frame : {1, 2}) {
        const double a = frame == 1 ? 1 : 0.2, b = 1.2 - a;
        std::string text =
            "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
            "property float delay\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
        for (const auto& [x, y, delay] : std::vector<std::array<double, 3>>{{0, 0, first_delay},
                                                                            {a, 0, first_delay},
                                                                            {0, a, first_delay},
                                                                            {5, 0, second_delay},
                                                                            {5 + b, 0, second_delay},
                                                                            {5, b, second_delay}})
            text += fmt::format("{} {} 0 {}\n", x, y, delay);
        files[frame] = folder.write(fmt::format("{}.ply", frame), text + "3 0 1 2\n3 3 4 5\n");
    }
    return std::make_shared<AnimatedMesh>(std::make_shared<MeshSequence>(files, "#.ply"), constant_motion({}));
}

TEST_CASE("births on a deforming mesh are uniform by its area at their own times", "[emit]")
{
    TemporaryFolder folder;
    NodeTest emit("emit",
                  {{"source", shrinking_and_growing(folder, 0, 0)}, {"rate", 20000.0 * fps}, {"motion", "linear"}});
    const PointSet born = emit(2);
    REQUIRE(born.size() == 20000);
    // At t the sides are a = 1 - 0.8 t and b = 0.2 + 0.8 t, and the first face has births with the probability
    // a²/(a² + b²).
    std::array<double, 4> first{}, all{};
    for (std::size_t i = 0; i < born.size(); ++i) {
        const double t = std::min(0.9999, 1 - double((*std::as_const(born).find<float>("dt"))[i]) * fps);
        const auto quarter = static_cast<std::size_t>(4 * t);
        all[quarter] += 1;
        first[quarter] += born.P()[i].x() < 2.5f;
    }
    const double early = 0.89355, late = 0.65804;  // means of the probability over the first two quarters
    const double expected[] = {early, late, 1 - late, 1 - early};
    for (std::size_t k = 0; k < 4; ++k) CHECK(first[k] / all[k] == Approx(expected[k]).margin(0.025));
}

TEST_CASE("births on a deforming mesh whose age is an attribute are uniform by its area at their own times", "[emit]")
{
    // Births on the first face are at the end of the frame, where its side is 0.2, those on the second half a frame
    // before, where its side is 0.6: the first has 0.2²/(0.2² + 0.6²) of them.
    TemporaryFolder folder;
    NodeTest emit("emit", {{"source", shrinking_and_growing(folder, 0, 0.5 / fps)},
                           {"rate", 20000.0 * fps},
                           {"motion", "linear"},
                           {"age", Value(AttributeRef{"delay"})}});
    const PointSet born = emit(2);
    REQUIRE(born.size() == 20000);
    double first = 0;
    for (std::size_t i = 0; i < born.size(); ++i) first += born.P()[i].x() < 2.5f;
    CHECK(first / 20000 == Approx(0.1).margin(0.01));
}

}  // namespace rapid
