// Objects that a program offers: its shapes, points, meshes and nodes work like Rapid's own, and faults in them are
// errors that name them.
#include <atomic>
#include <cmath>
#include <cstring>

#include "include/rapid/scene.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;

template <class T>
T good(Result<T> result)
{
    if (!result) FAIL(result.error().text());
    return std::move(*result);
}

SceneError error_of(const std::string& text, SceneOptions options, std::int64_t frame = 3)
{
    Result<Scene> scene = Scene::open_text("offers.lua", text, std::move(options));
    if (!scene) return scene.error();
    Result<SceneFrame> result = scene->advance_to(frame);
    if (result) FAIL("no error");
    return result.error();
}

// Returns all values of a column as text of their bits.
std::string bits_of(const SceneFrame& frame, const char* name)
{
    const SceneColumn column = *frame.column(name);
    std::string bits;
    for (std::size_t i = 0; i < column.count; ++i)
        bits.append(static_cast<const char*>(column.data) + i * column.stride, 4 * column.components);
    return bits;
}

HostShape ball(const std::array<double, 3>& center, double radius)
{
    HostShape shape;
    for (int axis = 0; axis < 3; ++axis) {
        shape.lower[axis] = center[axis] - radius;
        shape.upper[axis] = center[axis] + radius;
    }
    shape.distance = [=](std::size_t n, const double* P, double* phi, double* gradient) {
        for (std::size_t i = 0; i < n; ++i) {
            const double d[] = {P[3 * i] - center[0], P[3 * i + 1] - center[1], P[3 * i + 2] - center[2]};
            const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            phi[i] = length - radius;
            if (gradient)
                for (int axis = 0; axis < 3; ++axis) gradient[3 * i + axis] = length > 0 ? d[axis] / length : 0;
        }
    };
    return shape;
}

// Points in a slab above a ball fall onto it and slide off. SHAPE is replaced by the ball.
std::string rain(const std::string& shape)
{
    return "local rapid = require 'rapid'\n"
           "return rapid.create { points = rapid.points.grid { size = {2, 0.2, 2}, spacing = 0.1, center = {0, 2, 0} } "
           "}\n"
           ":gravity {} :collide { shape = " +
           shape + ", bounce = 0.3 } :solve { substeps = 2 }";
}

HostNode pull()
{
    HostNode node;
    node.name = "pull";
    node.doc = "Pulls to a place.";
    node.parameters = {{"strength", "acceleration by distance", 1.0, "1/s²", 0},
                       {"center", "to where", std::array<double, 3>{0, 0, 0}, "m"}};
    node.call = [](const HostCall& now) {
        for (std::size_t i = 0; i < 3 * now.count; ++i)
            now.acceleration[i] = now.parameters[0] * (now.parameters[1 + i % 3] - now.P[i]);
    };
    return node;
}

const std::string one =
    "local rapid = require 'rapid'\nreturn rapid.create { points = rapid.points.from { P = {{1, 0, 0}, {0, 2, 0}} } "
    "}\n";

}  // namespace

TEST_CASE("points collide with a program's ball as with Rapid's", "[offers]")
{
    SceneOptions options;
    options.objects = {{"ball", ball({0, 1, 0}, 0.5)}};
    Scene mine = good(Scene::open_text("rain.lua", rain("rapid.host 'ball'"), options));
    Scene own = good(Scene::open_text("rain.lua", rain("rapid.shape.sphere { radius = 0.5, center = {0, 1, 0} }")));
    // Frame 9 has the first impacts. Later ones differ, because Rapid also knows the curvature of its own sphere.
    const SceneFrame a = good(mine.advance_to(9)), b = good(own.advance_to(9));
    CHECK(a.statistics().collisions == 32);
    CHECK(b.statistics().collisions == 32);
    const SceneColumn P = *a.column("P"), Q = *b.column("P");
    REQUIRE(P.count == Q.count);
    for (std::size_t i = 0; i < P.count; ++i)
        for (int axis = 0; axis < 3; ++axis) REQUIRE(P.at<float>(i)[axis] == Approx(Q.at<float>(i)[axis]).margin(1e-6));
    for (int frame = 10; frame <= 30; ++frame) {
        const SceneFrame later = good(mine.advance());
        for (std::size_t i = 0; i < later.size(); ++i) {
            const float* at = later.column("P")->at<float>(i);
            REQUIRE(std::hypot(at[0], at[1] - 1, at[2]) > 0.5 - 1e-5);
        }
    }
}

TEST_CASE("a program's shape with a hollow is found along each path", "[offers]")
{
    // A ring about the y axis: the distance is exact, and the shape is not convex.
    HostShape ring;
    ring.lower = {-1.5, -0.5, -1.5};
    ring.upper = {1.5, 0.5, 1.5};
    ring.smallest_feature = 0.05;
    std::atomic<std::size_t> calls = 0, places = 0;
    ring.distance = [&](std::size_t n, const double* P, double* phi, double* gradient) {
        ++calls;
        places += n;
        for (std::size_t i = 0; i < n; ++i, P += 3) {
            const double out = std::hypot(P[0], P[2]), d[] = {out - 1, P[1]}, length = std::hypot(d[0], d[1]);
            phi[i] = length - 0.5;
            if (!gradient) continue;
            gradient[3 * i] = out > 0 && length > 0 ? d[0] / length * P[0] / out : 0;
            gradient[3 * i + 1] = length > 0 ? d[1] / length : 0;
            gradient[3 * i + 2] = out > 0 && length > 0 ? d[0] / length * P[2] / out : 0;
        }
    };
    SceneOptions options;
    options.objects = {{"ball", ring}};
    Scene scene = good(Scene::open_text("rain.lua", rain("rapid.host 'ball'"), options));
    for (int frame = 1; frame <= 40; ++frame) {
        const SceneFrame now = good(scene.advance());
        for (std::size_t i = 0; i < now.size(); ++i) {
            const float* at = now.column("P")->at<float>(i);
            REQUIRE(std::hypot(std::hypot(at[0], at[2]) - 1, at[1]) > 0.5 - 1e-4);
        }
    }
    CHECK(places > 3 * calls);
}

TEST_CASE("a program's shape without an outside ends no run: its points count as trapped", "[offers]")
{
    HostShape everywhere;
    everywhere.lower.fill(-1e9);
    everywhere.upper.fill(1e9);
    everywhere.distance = [](std::size_t n, const double*, double* phi, double* gradient) {
        std::fill_n(phi, n, -1.0);
        if (gradient) std::fill_n(gradient, 3 * n, 0.0);
    };
    SceneOptions options;
    options.objects = {{"everywhere", everywhere}};
    const std::string text = one + ":gravity {} :collide { shape = rapid.host 'everywhere' } :solve {}";
    Scene scene = good(Scene::open_text("one.lua", text, options));
    const SceneFrame now = good(scene.advance_to(4));
    CHECK(now.size() == 2);
    REQUIRE(now.warnings().size() == 1);
    CHECK_THAT(now.warnings()[0], Contains("some points can't leave a shape"));
}

TEST_CASE("a setting replaces a shape of the scene by one of the program", "[offers]")
{
    SceneOptions options;
    options.objects = {{"ball", ball({0, 1, 0}, 0.5)}};
    Scene direct = good(Scene::open_text("rain.lua", rain("rapid.host 'ball'"), options));
    options.set = {{"collide1.shape", "host:ball"}};
    Scene set = good(Scene::open_text("rain.lua", rain("rapid.shape.plane {}"), options));
    CHECK(bits_of(good(set.advance_to(20)), "P") == bits_of(good(direct.advance_to(20)), "P"));
}

TEST_CASE("an object that is not offered is an error that lists the offered ones", "[offers]")
{
    SceneOptions options;
    options.objects = {{"ball", ball({0, 1, 0}, 0.5)}, {"other", ball({0, 1, 0}, 0.5)}};
    CHECK_THAT(error_of(rain("rapid.host 'bal'"), options).text(),
               Contains("offers.lua:3") && Contains("did you mean \"ball\""));
    CHECK_THAT(error_of(rain("rapid.host 'nothing'"), options).message, Contains("it offers ball, other"));
    CHECK_THAT(error_of(rain("rapid.host 'ball'"), {}).message, Contains("offers no objects"));
    CHECK_THAT(error_of(rain("rapid.host(3)"), options).message, Contains("needs the name"));
}

TEST_CASE("a program's force is Rapid's own law", "[offers]")
{
    // x'' = -4 x has the solution cos 2t, which many substeps approach.
    SceneOptions options;
    options.nodes = {pull()};
    Scene scene = good(Scene::open_text("pull.lua", one + ":pull { strength = 4 } :solve { substeps = 200 }", options));
    const SceneFrame frame = good(scene.advance_to(25));
    CHECK(frame.column("P")->at<float>(0)[0] == Approx(std::cos(2.0)).margin(1e-4));
    CHECK(frame.column("P")->at<float>(1)[1] == Approx(2 * std::cos(2.0)).margin(1e-4));
    bool listed = false;
    for (const SceneNodeType& type : good(scene.node_types()))
        if (type.name == "pull") listed = type.parameters.size() == 3 && type.parameters[1].unit == "1/s²";
    CHECK(listed);
}

TEST_CASE("a program's node is checked as any other", "[offers]")
{
    SceneOptions options;
    options.nodes = {pull()};
    CHECK_THAT(error_of(one + ":pull { strenth = 4 } :solve {}", options).text(),
               Contains("offers.lua:3") && Contains("did you mean \"strength\""));
    CHECK_THAT(error_of(one + ":pull { strength = 'x' } :solve {}", options).message, Contains("strength"));
    CHECK_THAT(error_of(one + ":pull { strength = -1 } :solve {}", options).message, Contains("at least 0"));
    CHECK_THAT(error_of(one + ":pull { center = 3 } :solve {}", options).message, Contains("center"));
    CHECK_THAT(error_of(one + ":pull { group = 'nobody' } :solve {}", options).message, Contains("nobody"));
}

TEST_CASE("a program's edit reads and writes columns, in a group, and takes points away", "[offers]")
{
    HostNode node;
    node.name = "burn";
    node.doc = "Heats, and kills what is hot.";
    node.kind = HostNode::Edit;
    node.reads = {{"shade", ColumnType::Float}};
    node.writes = {{"heat", ColumnType::Float}, {"v", ColumnType::Vec3}};
    node.call = [](const HostCall& now) {
        for (std::size_t i = 0; i < now.count; ++i) {
            now.writes[0][i] += now.reads[0][i];
            now.writes[1][3 * i] = 1;
            now.kill[i] = now.writes[0][i] > 3;
        }
    };
    SceneOptions options;
    options.nodes = {node};
    const std::string text =
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.grid { size = {1, 0, 1}, spacing = 0.1 } }\n"
        ":attribute { shade = 1 } :group { name = 'left', where = function(p) return p.P.z < 0 end }\n"
        ":burn { group = 'left' } :solve {}";
    Scene scene = good(Scene::open_text("burn.lua", text, options));
    const SceneFrame third = good(scene.advance_to(3));  // two frames after the start
    REQUIRE(third.size() == 100);
    for (std::size_t i = 0; i < 100; ++i) {
        const bool left = third.column("P")->at<float>(i)[2] < 0;
        REQUIRE(*third.column("heat")->at<float>(i) == (left ? 2 : 0));
        REQUIRE(third.column("v")->at<float>(i)[0] == (left ? 1 : 0));
    }
    const SceneFrame fifth = good(scene.advance_to(5));
    CHECK(fifth.size() == 50);
    CHECK(fifth.statistics().died == 50);
}

TEST_CASE("a program's constraint keeps points at a distance", "[offers]")
{
    HostNode node;
    node.name = "chain";
    node.doc = "Ties each point to the next.";
    node.kind = HostNode::Constraint;
    node.parameters = {{"length", "of a link", 1.0, "m", 0}};
    node.call = [](const HostCall& now) {
        for (std::size_t i = 1; i < now.count; ++i)
            now.rods->push_back({now.id[i - 1], now.id[i], now.parameters[0], 0});
    };
    SceneOptions options;
    options.nodes = {node};
    const std::string text =
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},"
        " v = {{0, 3, 0}, {0, 0, 0}, {0, 0, 5}} } }\n"
        ":gravity {} :chain {} :solve { substeps = 20 }";
    Scene scene = good(Scene::open_text("chain.lua", text, options));
    for (int frame = 1; frame <= 48; ++frame) {
        const SceneFrame now = good(scene.advance());
        const SceneColumn P = *now.column("P");
        for (std::size_t i = 1; i < 3; ++i) {
            const float *a = P.at<float>(i - 1), *b = P.at<float>(i);
            REQUIRE(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) == Approx(1).epsilon(1e-3));
        }
        // Their centre of mass falls freely.
        const double t = (frame - 1) / 24.0;
        const float sum = P.at<float>(0)[1] + P.at<float>(1)[1] + P.at<float>(2)[1];
        REQUIRE(sum / 3 == Approx(t - 9.81 / 2 * t * t).margin(1e-3));
    }

    const auto error_with = [&](const HostRod& rod) {
        options.nodes[0].call = [rod](const HostCall& now) { now.rods->push_back(rod); };
        return error_of(text, options);
    };
    CHECK_THAT(error_with({0, 7, 1, 0}).message, Contains("between the ids 0 and 7"));
    CHECK_THAT(error_with({1, 1, 1, 0}).message, Contains("two points"));
    CHECK_THAT(error_with({0, 1, -1, 0}).message, Contains("length -1"));
    CHECK_THAT(error_with({0, 1, 1, NAN}).message, Contains("compliance nan"));
    CHECK(error_with({0, 1, -1, 0}).node == "chain1");
}

TEST_CASE("a program's points and meshes are taken", "[offers]")
{
    const std::vector<float> P = {0, 1, 0, 0, 2, 0, 0, 3, 0}, heat = {5, 0, 6, 0, 7, 0};
    HostPoints points;
    points.count = 3;
    points.columns = {{"P", ColumnType::Vec3, P.data()}, {"heat", ColumnType::Float, heat.data(), 8}};
    HostMesh square;
    square.positions = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
    square.triangles = {{0, 2, 1}, {0, 3, 2}};
    SceneOptions options;
    options.objects = {{"cloud", points}, {"square", square}};
    Scene scene = good(
        Scene::open_text("cloud.lua",
                         "local rapid = require 'rapid'\nlocal cloud = rapid.create { points = rapid.host 'cloud' }\n"
                         "return cloud:emit { source = rapid.host 'square', rate = 2400 } :solve {}",
                         options));
    const SceneFrame first = good(scene.advance());
    REQUIRE(first.size() == 3);
    CHECK(*first.column("heat")->at<float>(1) == 6);
    CHECK(first.column("P")->at<float>(2)[1] == 3);
    const SceneFrame second = good(scene.advance());
    CHECK(second.size() == 103);
    for (std::size_t i = 3; i < second.size(); ++i) CHECK(second.column("P")->at<float>(i)[1] == 0);
}

TEST_CASE("an object that changes is offered again, and taken by a function of the frame", "[offers]")
{
    HostMesh mesh;
    const auto at_height = [&](float y) {
        mesh.positions = {{0, y, 0}, {1, y, 0}, {1, y, 1}};
        mesh.triangles = {{0, 2, 1}};
        return mesh;
    };
    SceneOptions options;
    options.objects = {{"moves", at_height(1)}};
    Scene scene =
        good(Scene::open_text("moves.lua",
                              "local rapid = require 'rapid'\nreturn rapid.create { fps = 24 }"
                              ":emit { source = function() return rapid.host 'moves' end, rate = 240 } :solve {}",
                              options));
    good(scene.advance_to(2));
    good(scene.offer("moves", at_height(5)));
    const SceneFrame frame = good(scene.advance());
    REQUIRE(frame.size() == 20);
    int high = 0;
    for (std::size_t i = 0; i < frame.size(); ++i) high += frame.column("P")->at<float>(i)[1] > 4;
    CHECK(high == 10);
}

TEST_CASE("wrong offers are errors by name", "[offers]")
{
    const auto refused = [](const std::string& name, HostObject object) {
        SceneOptions options;
        options.objects = {{name, std::move(object)}};
        return error_of(one + ":solve {}", options).message;
    };
    HostShape shape = ball({0, 0, 0}, 1);
    shape.distance = nullptr;
    CHECK_THAT(refused("ball", shape),
               Contains("the program offers \"ball\": the function of the distance is missing"));
    shape = ball({0, 0, 0}, 1);
    std::swap(shape.lower, shape.upper);
    CHECK_THAT(refused("ball", shape), Contains("bounds"));
    shape = ball({0, 0, 0}, 1);
    shape.slope_bound = 0.5;
    CHECK_THAT(refused("ball", shape), Contains("slope_bound"));
    HostMesh mesh;
    CHECK_THAT(refused("mesh", mesh), Contains("no triangles"));
    mesh.positions = {{0, 0, 0}};
    mesh.triangles = {{0, 0, 1}};
    CHECK_THAT(refused("mesh", mesh), Contains("triangle 0 has a corner at position 1; there are 1"));
    mesh.positions = {{0, NAN, 0}};
    CHECK_THAT(refused("mesh", mesh), Contains("not finite"));
    HostPoints points;
    points.count = 1;
    const float values[] = {0, NAN, 0};
    CHECK_THAT(refused("cloud", points), Contains("P is missing"));
    points.columns = {{"P", ColumnType::Vec3, nullptr}};
    CHECK_THAT(refused("cloud", points), Contains("null"));
    points.columns = {{"P", ColumnType::Vec3, values}};
    CHECK_THAT(refused("cloud", points), Contains("P is nan at index 0"));
    points.columns = {{"P", ColumnType::Float, values}};
    CHECK_THAT(refused("cloud", points), Contains("P has the type float; it must be vec3"));
    const std::uint32_t unknown[] = {4'000'000'000};
    points.columns = {{"P", ColumnType::Vec3, values}, {"name", ColumnType::String, unknown}};
    CHECK_THAT(refused("cloud", points), Contains("P is nan") || Contains("no string has the number 4000000000"));
    points.columns = {{"mass", ColumnType::Vec3, values}};
    CHECK_THAT(refused("cloud", points), Contains("mass"));

    const auto refused_node = [](HostNode node) {
        SceneOptions options;
        options.nodes = {std::move(node)};
        return error_of(one + ":solve {}", options).message;
    };
    HostNode node = pull();
    node.name = "gravity";
    CHECK_THAT(refused_node(node), Contains("a node \"gravity\" exists already"));
    node.name = "two words";
    CHECK_THAT(refused_node(node), Contains("a word"));
    node = pull();
    node.call = nullptr;
    CHECK_THAT(refused_node(node), Contains("no function"));
    node = pull();
    node.writes = {{"heat", ColumnType::Float}};
    CHECK_THAT(refused_node(node), Contains("a force can't write columns"));
    node = pull();
    node.reads = {{"mass", ColumnType::Vec3}};
    CHECK_THAT(refused_node(node), Contains("mass"));
    node = pull();
    node.parameters.push_back(node.parameters[0]);
    CHECK_THAT(refused_node(node), Contains("parameter \"strength\""));
}

TEST_CASE("a callback that throws, writes NaN or past its array's end is an error of the frame", "[offers]")
{
    const auto error_with = [](const std::function<void(const HostCall&)>& call) {
        HostNode node = pull();
        node.call = call;
        SceneOptions options;
        options.nodes = {node};
        options.guard_callbacks = true;
        return error_of(one + ":pull {} :solve {}", options);
    };
    const SceneError threw = error_with([](const HostCall&) { throw std::runtime_error("broken"); });
    CHECK(threw.kind == SceneError::FailedFrame);
    CHECK(threw.node == "pull1");
    CHECK_THAT(threw.message, Contains("pull") && Contains("broken"));
    CHECK_THAT(error_with([](const HostCall&) { throw 3; }).message, Contains("not a std::exception"));
    CHECK_THAT(error_with([](const HostCall& now) { now.acceleration[4] = NAN; }).message, Contains("nan at index 1"));
    CHECK_THAT(error_with([](const HostCall& now) { now.acceleration[3 * now.count] = 1; }).message,
               Contains("beyond the end"));

    HostShape shape = ball({0, 1, 0}, 0.5);
    shape.distance = [](std::size_t n, const double*, double* phi, double*) { std::fill_n(phi, n, NAN); };
    SceneOptions options;
    options.objects = {{"ball", shape}};
    const SceneError nan = error_of(rain("rapid.host 'ball'"), options, 12);
    CHECK_THAT(nan.message, Contains("the distance of the program's shape \"ball\" is nan"));
    CHECK(nan.kind == SceneError::FailedFrame);
}

TEST_CASE("a program's force gives the same bits on any number of threads", "[offers][threads]")
{
    const auto bits = [](int threads) {
        SceneOptions options;
        options.nodes = {pull()};
        options.threads = threads;
        const std::string text =
            "local rapid = require 'rapid'\nreturn rapid.create { points = rapid.points.grid { spacing = 0.03 } }"
            ":pull { strength = 3 } :solve { substeps = 3 }";
        Scene scene = good(Scene::open_text("pull.lua", text, options));
        const SceneFrame frame = good(scene.advance_to(5));
        CHECK(frame.size() > 30000);
        return bits_of(frame, "P") + bits_of(frame, "v");
    };
    CHECK(bits(1) == bits(2));
}

}  // namespace rapid
