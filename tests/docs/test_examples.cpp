// The examples of docs/extending.md, compiled into this program, do as their comments say.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>

#include "bindings/command_line/command.h"
#include "bindings/host/session.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/plugin.h"
#include "runtime/io/format.h"
#include "tests/docs/document.h"
#include "tests/files/temporary_folder.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

const fs::path examples = RAPID_EXAMPLES;  // the folder into which the build extracts them

// Returns the points of a chain of nodes after a number of frames of 1/24 s. The example in Lua is next to the scene.
PointSet run(const std::string& chain, int frames)
{
    const test::TemporaryFolder folder;
    fs::copy_file(examples / "lua/nodes/breathe.lua", folder / "breathe.lua");
    const fs::path scene = folder.write("scene.lua", "local rapid = require \"rapid\"\nreturn " + chain + "\n");
    const Session session(scene, {});
    const Plan plan(session.graph(), {});
    Evaluator evaluator(plan);
    PointSet points = evaluator.advance().outputs.at("main");
    for (int frame = 0; frame < frames; ++frame) points = evaluator.advance().outputs.at("main");
    return points;
}

// Returns the output that f writes to standard output.
template <class F>
std::string printed_by(const F& f)
{
    const test::TemporaryFolder folder;
    const fs::path file = folder / "out";
    std::fflush(stdout);
    const int kept = dup(STDOUT_FILENO);
    REQUIRE(std::freopen(file.c_str(), "w", stdout));
    f();
    std::fflush(stdout);
    dup2(kept, STDOUT_FILENO);
    close(kept);
    return test::read_text(file);
}

}  // namespace

TEST_CASE("the example of a node makes radii smaller by its rate", "[docs]")
{
    const PointSet points =
        run("rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, pscale = {0.1} } }"
            ":shrink { rate = 2 } :solve {}",
            24);
    CHECK(points.column<float>("pscale")[0] == Approx(0.1 * std::exp(-2.0)).epsilon(1e-5));
}

TEST_CASE("the example of a force is exact, at any number of sub-steps", "[docs]")
{
    const std::string substeps = GENERATE("1", "7");
    const PointSet points =
        run("rapid.create { points = rapid.points.from { P = {{0, 2, 0}} } }"
            ":shear { rate = 3, drag = 4 } :solve { substeps = " +
                substeps + " }",
            24);
    const double u = 6, k = 4, t = 1, v = u * (1 - std::exp(-k * t));
    CHECK_THAT(points.v()[0], test::close_to(Vec3f(static_cast<float>(v), 0, 0), 1e-5));
    CHECK_THAT(points.P()[0], test::close_to(Vec3f(static_cast<float>(u * t - v / k), 2, 0), 1e-5));
}

TEST_CASE("the example of a constraint holds points at its length, and leaves nearer points free", "[docs]")
{
    const PointSet points = run(
        "rapid.create { points = rapid.points.from { P = {{0, -1, 0}, {0.5, 0, 0}}, v = {{0, 0, 0}, {-0.5, 0, 0}} } }"
        ":group { name = \"heavy\", where = function(p) return p.P.y < 0 end }"
        ":gravity { group = \"heavy\" } :tether { length = 1 } :solve { substeps = 8 }",
        24);
    CHECK_THAT(points.P()[0], test::close_to(Vec3f(0, -1, 0), 1e-5));
    CHECK_THAT(points.P()[1], test::close_to(Vec3f(0, 0, 0), 1e-5));
}

TEST_CASE("the example of a shape is hit where its edge is", "[docs]")
{
    // The point falls straight down onto the rounded upper edge, 0.06 m inside the side, and sticks where it hits.
    const PointSet points =
        run("rapid.create { points = rapid.points.from { P = {{0.44, 3, 0}, {0, 3, 0}} } }"
            ":gravity {} :collide { shape = rapid.shape.rounded_box { size = {1, 2, 1}, radius = 0.1 }, response = "
            "\"stick\" }"
            ":solve {}",
            24);
    const double along = 0.04;  // from the axis of the rounding
    const auto top = static_cast<float>(0.9 + std::sqrt(0.1 * 0.1 - along * along));
    CHECK_THAT(points.P()[0], test::close_to(Vec3f(0.44f, top, 0), 1e-5));
    CHECK_THAT(points.P()[1], test::close_to(Vec3f(0, 1, 0), 1e-5));
}

TEST_CASE("the example of a shape moves by :transform, and carries what sticks to it", "[docs]")
{
    const PointSet points =
        run("rapid.create { points = rapid.points.from { P = {{0, 3, 0}} } }"
            ":gravity {} :collide { shape = rapid.shape.rounded_box { size = {1, 2, 1} }:transform(function(frame)"
            " return rapid.translate(0.01 * (frame.number - 25), 0, 0) end), response = \"stick\" } :solve {}",
            24);
    CHECK(points.P()[0].y() == Approx(1).epsilon(1e-5));
    CHECK(points.v()[0].x() == Approx(0.24).epsilon(1e-5));  // 0.01 m per frame of 1/24 s
}

TEST_CASE("the example of a format is read as it was written", "[docs]")
{
    const test::TemporaryFolder folder;
    const PointSet points = test::points({{1, 2, 3}, {-4, 5e-7f, 6e8f}});
    write_points(folder / "some.raw", points);
    const PointSet read = read_points(folder / "some.raw");
    REQUIRE(read.size() == 2);
    CHECK(read.P()[0] == points.P()[0]);
    CHECK(read.P()[1] == points.P()[1]);
    CHECK(read.id()[1] == 1);
}

TEST_CASE("the example of a node in Lua follows its sine", "[docs]")
{
    const PointSet points =
        run("rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, pscale = {0} } }"
            ":breathe { size = 0.1, amount = 0.5, rate = 1 } :solve {}",
            6);
    CHECK(points.column<float>("pscale")[0] == Approx(0.15).epsilon(1e-6));  // a quarter of a second
}

TEST_CASE("the example of a plugin is loaded, and stops points", "[docs]")
{
    load_plugin(RAPID_EXAMPLE_PLUGIN);
    const PointSet points =
        run("rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, v = {{3, 0, 0}} } }"
            ":gate { x = 1 } :solve { substeps = 4 }",
            24);
    CHECK(points.P()[0] == Vec3f(1, 0, 0));
    CHECK(points.v()[0] == Vec3f(0, 0, 0));
}

TEST_CASE("the example of a command counts points", "[docs]")
{
    const test::TemporaryFolder folder;
    const fs::path file = folder / "some.csv";
    write_points(file, test::points({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
    for (const std::unique_ptr<Command>& command : make_commands()) {
        if (command->name() != "count") continue;
        CLI::App app;
        Options options(app);
        command->declare(options);
        app.parse("\"" + file.string() + "\"");
        int status = status_failed;
        CHECK(printed_by([&] { status = command->run({}); }) == "3\n");
        CHECK(status == status_done);
        return;
    }
    FAIL("there is no such command");
}

}  // namespace rapid
