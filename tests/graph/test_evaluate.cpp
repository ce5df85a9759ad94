#include "runtime/graph/evaluate.h"

#include "tests/graph/graph_under_test.h"

namespace rapid {

using test::error_of;
using test::evaluations;
using test::GraphUnderTest;
using test::of_frame;
using test::starts;

TEST_CASE("what solve posts is what create yields in the next frame", "[evaluate]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source", {}, {{"fps", Value(10.0)}, {"start", Value(3.0)}});
    const NodePtr inside = scene.node("shift", {source}, {{"by", Value(Vec3d(1, 0, 0))}}, "inside");
    const NodePtr post = scene.node("post", {inside});
    const NodePtr after = scene.node("shift", {post}, {{"by", Value(Vec3d(0, 5, 0))}}, "after");
    const Plan plan(scene.returning(after), {});
    Evaluator evaluator(plan);

    for (int frame = 3; frame < 9; ++frame) {
        CAPTURE(frame);
        CHECK(evaluator.next_frame() == frame);
        const FrameResult result = evaluator.advance();
        CHECK(result.frame == frame);
        // Between create and solve nothing runs at the first frame; nodes after solve change only the output.
        CHECK(result.outputs.at("main").P()[0] == Vec3f(static_cast<float>(frame - 3), 5, 0));
        CHECK(result.fps.at("main") == 10);
        CHECK(result.time.at("main") == (frame - 3) / 10.0);
    }
    CHECK(evaluations == std::map<std::string, int>{{"source1", 6}, {"inside", 5}, {"post1", 5}, {"after", 6}});
    CHECK(starts == std::map<std::string, int>{{"post1", 1}});
}

TEST_CASE("with subframes the nodes of the loop are evaluated once per subframe, those after solve once per frame",
          "[evaluate]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source", {}, {{"start", Value(3.0)}, {"subframes", Value(4.0)}});
    const NodePtr inside = scene.node("shift", {source}, {{"by", Value(Vec3d(1, 0, 0))}}, "inside");
    const NodePtr post = scene.node("post", {inside});
    const NodePtr after = scene.node("shift", {post}, {{"by", Value(Vec3d(0, 5, 0))}}, "after");
    const Plan plan(scene.returning(after), {});
    Evaluator evaluator(plan);
    for (int frame = 3; frame < 6; ++frame) {
        const FrameResult result = evaluator.advance();
        CHECK(result.frame == frame);
        CHECK(result.outputs.at("main").P()[0] == Vec3f(static_cast<float>(4 * (frame - 3)), 5, 0));
        CHECK(result.time.at("main") == (frame - 3) / 24.0);
    }
    CHECK(evaluations == std::map<std::string, int>{{"source1", 9}, {"inside", 8}, {"post1", 8}, {"after", 3}});
}

TEST_CASE("a frame's steps are identified by their index, the last by the frame's own number and time", "[evaluate]")
{
    const FrameClock clock{25, 5, 3};
    CHECK(clock.at_step(5).number == 5);
    CHECK(clock.at_step(8).number == 6);
    CHECK(clock.at_step(8).time == clock.at(6).time);
    CHECK(clock.at_step(7).number == Approx(5 + 2.0 / 3));
    CHECK(clock.at_step(7).dt == 1.0 / 75);
    for (std::int64_t step = 5; step < 40; ++step) {
        CHECK(clock.step_at(clock.at_step(step)) == step);
        CHECK(clock.is_whole(step) == ((step - 5) % 3 == 0));
    }
    CHECK(clock.step_of(7) == 11);
}

TEST_CASE("what never changes is evaluated once, and its result is kept from those that change it", "[evaluate]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr still = scene.node("shift", {source}, {}, "still");
    const NodePtr varies = scene.node("jitter", {still}, {}, "varies");
    const NodePtr behind = scene.node("shift", {varies}, {}, "behind");
    const Plan plan(scene.returning({{"main", behind}, {"still", still}}), {});
    Evaluator evaluator(plan);

    for (int frame = 1; frame <= 4; ++frame) {
        const FrameResult result = evaluator.advance();
        CHECK(result.outputs.at("main").P()[0] == Vec3f(2, 0, 0));
        CHECK(result.outputs.at("still").P()[0] == Vec3f(1, 0, 0));
    }
    CHECK(evaluations == std::map<std::string, int>{{"source1", 1}, {"still", 1}, {"varies", 4}, {"behind", 4}});
}

TEST_CASE("nodes that no output comes from are never evaluated", "[evaluate]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    scene.node("fail", {source});
    const Plan plan(scene.returning(source), {});
    Evaluator evaluator(plan);
    CHECK_NOTHROW(evaluator.advance());
}

TEST_CASE("a node with two readers is evaluated once a frame, and neither sees what the other changes", "[evaluate]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr shared = scene.node("jitter", {source}, {}, "shared");
    const NodePtr left = scene.node("shift", {shared}, {{"by", Value(Vec3d(-1, 0, 0))}}, "left");
    const NodePtr right = scene.node("shift", {shared}, {{"by", Value(Vec3d(1, 0, 0))}}, "right");
    const Plan plan(scene.returning({{"left", left}, {"right", right}, {"shared", shared}}), {});
    Evaluator evaluator(plan);
    const FrameResult result = evaluator.advance();
    CHECK(result.outputs.at("left").P()[0].x() == -1);
    CHECK(result.outputs.at("right").P()[0].x() == 1);
    CHECK(result.outputs.at("shared").P()[0].x() == 0);
    CHECK(evaluations["shared"] == 1);
}

TEST_CASE("functions are called in each frame with its number, time and length", "[evaluate]")
{
    std::vector<Frame> requested;
    GraphUnderTest scene;
    const NodePtr source = scene.node("source", {}, {{"fps", Value(4.0)}});
    const NodePtr moving = scene.node("shift", {source}, {{"by", of_frame([&](const Frame& frame) {
                                                               requested.push_back(frame);
                                                               return Value(Vec3d(frame.number, 0, 0));
                                                           })}});
    const Plan plan(scene.returning(moving), {});
    Evaluator evaluator(plan);
    requested.clear();  // the plan has called it for the first frame
    for (int frame = 1; frame <= 3; ++frame) {
        CHECK(evaluator.advance().outputs.at("main").P()[0].x() == static_cast<float>(frame));
        CHECK(requested.back().number == frame);
        CHECK(requested.back().time == (frame - 1) / 4.0);
        CHECK(requested.back().dt == 0.25);
    }
    CHECK(requested.size() == 3);
}

TEST_CASE("an error of a node or its function names the node, the line and the frame", "[evaluate]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    SECTION("of the node")
    {
        const Plan plan(scene.returning(scene.node("fail", {source})), {});
        Evaluator evaluator(plan);
        CHECK(error_of([&] { evaluator.advance(); }) == "scene.lua:2: node \"fail1\": it can't be done");
    }
    SECTION("of memory")
    {
        const Plan plan(scene.returning(scene.node("fail", {source}, {{"out_of_memory", Value(true)}}, "huge")), {});
        Evaluator evaluator(plan);
        CHECK(error_of([&] { evaluator.advance(); }) == "scene.lua:2: node \"huge\": out of memory");
    }
    SECTION("of its function")
    {
        const NodePtr far =
            scene.node("shift", {source},
                       {{"by", of_frame([](const Frame& frame) { return Value(Vec3d(-40 * frame.number, 0, 0)); })}});
        const Plan plan(scene.returning(far), {});
        Evaluator evaluator(plan);
        evaluator.advance();
        evaluator.advance();
        CHECK(error_of([&] { evaluator.advance(); }) ==
              "scene.lua:2: node \"shift1\": by = -120 is out of range; it must be at least -100 (frame 3)");
    }
}

TEST_CASE("dynamics travel to solve and end there; figures and warnings come with their frame", "[evaluate]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr pushed = scene.node("push", {scene.node("push", {source})});
    const NodePtr post = scene.node("post", {scene.node("shift", {pushed})});
    const Plan plan(scene.returning(post), {});
    Evaluator evaluator(plan);
    const FrameResult first = evaluator.advance();
    CHECK(first.figures.collisions == 0);
    CHECK(first.warnings.empty());
    for (int frame = 2; frame <= 3; ++frame) {
        const FrameResult result = evaluator.advance();
        CHECK(result.figures.substeps == 2);
        CHECK(result.figures.collisions == 1);
        CHECK(result.warnings == std::vector<std::string>{"shifted"});
        CHECK(result.total_seconds >= result.figures.seconds.solve);
    }
}

TEST_CASE("a simulation that starts later waits at its first frame", "[evaluate]")
{
    GraphUnderTest scene;
    const auto moving = [&](double start) {
        const NodePtr source = scene.node("source", {}, {{"start", Value(start)}});
        return scene.node("post", {scene.node("shift", {source})});
    };
    const NodePtr early = moving(1), late = moving(3);
    const Plan plan(scene.returning({{"early", early}, {"late", late}}), {});
    Evaluator evaluator(plan);
    const float expected[][2] = {{0, 0}, {1, 0}, {2, 0}, {3, 1}, {4, 2}};
    for (const auto& [at_early, at_late] : expected) {
        const FrameResult result = evaluator.advance();
        CAPTURE(result.frame);
        CHECK(result.outputs.at("early").P()[0].x() == at_early);
        CHECK(result.outputs.at("late").P()[0].x() == at_late);
    }
}

TEST_CASE("files of a node go to the hook, with the frame of its simulation", "[evaluate]")
{
    GraphUnderTest scene;
    const NodePtr source = scene.node("source", {}, {{"fps", Value(5.0)}});
    const NodePtr post = scene.node("post", {scene.node("shift", {source})});
    const Plan plan(scene.returning(scene.node("write", {post})), {});
    std::vector<std::string> written;
    Evaluator evaluator(plan, [&](const std::string& pattern, const PointSet& points, const Frame& frame, double fps) {
        CHECK(fps == 5);
        CHECK(points.P()[0].x() == static_cast<float>(frame.number - 1));
        written.push_back(pattern + " " + std::to_string(static_cast<int>(frame.number)));
    });
    for (int frame = 1; frame <= 3; ++frame) evaluator.advance();
    CHECK(written == std::vector<std::string>{"a.csv 1", "a.csv 2", "a.csv 3"});

    const Plan silent(scene.returning(scene.node("write", {post}, {}, "other")), {});
    Evaluator nowhere(silent);
    CHECK_NOTHROW(nowhere.advance());
}

}  // namespace rapid
