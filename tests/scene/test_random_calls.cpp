// Random sequences of calls of scene.h (call_model.h); wrong names, numbers, files and arrays are refused.
//
//   HOST_CALLS=24000 test_scene "any sequence*"      more of them; RC_PARAMS="seed=7" others
#include <limits>
#include <optional>

#include "bindings/scene/scene_inside.h"
#include "tests/scene/call_model.h"

namespace rapid {
namespace {

using test::Answer;
using test::Hostile;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <class T>
Answer answer(const Result<T>& result)
{
    return result ? Answer{} : Answer{result.error().kind, result.error().text()};
}

// Converts the result of a call to an answer, and stores the created object in the handle.
template <class T, class Handle>
Answer taken(Result<T> result, Handle& handle)
{
    const Answer reported = answer(result);
    if (result) handle.emplace(std::move(*result));
    return reported;
}

Hostile hostile_text(const std::string& text, const SceneOptions& options = {})
{
    return [=] { return answer(rapid::Scene::open_text("hostile.lua", text, options)); };
}

struct CppFace {
    using Scene = std::optional<rapid::Scene>;
    using Frame = std::optional<SceneFrame>;
    using Snapshot = std::optional<SceneSnapshot>;
    static constexpr bool refuses_closed = false;  // an empty optional cannot be called

    static Answer open(Scene& scene) { return taken(rapid::Scene::open_text("fall.lua", test::falling_scene), scene); }
    static Answer close(Scene& scene) { return release(scene); }
    static Answer advance(Scene& scene, Frame& frame) { return taken(scene->advance(), frame); }
    static Answer advance_to(Scene& scene, std::int64_t number, Frame& frame)
    {
        return taken(scene->advance_to(number), frame);
    }
    static bool is_there(const Frame& frame) { return frame.has_value(); }
    static Answer restart(Scene& scene) { return answer(scene->restart()); }
    static Answer set(Scene& scene, const char* name, double value) { return answer(scene->set(name, value)); }
    static Answer save(Scene& scene, Snapshot& snapshot) { return taken(scene->save(), snapshot); }
    static Answer restore(Scene& scene, const Snapshot& snapshot) { return answer(scene->restore(*snapshot)); }
    static Answer cancel(Scene& scene)
    {
        scene->cancel();
        return {};
    }
    template <class Handle>
    static Answer release(Handle& handle)
    {
        handle.reset();
        return {};
    }
    static Answer height(const Frame& frame, std::size_t& count, double& y)
    {
        const Result<SceneColumn> P = frame->column("P");
        if (!P) return answer(P);
        count = P->count;
        y = P->at<float>(0)[1];
        return {};
    }
    static Answer inspect(Scene& scene, const Frame* frame, std::int64_t& next)
    {
        next = scene->next_frame();
        if (frame) {
            const Result<FrameComparison> compared = (*frame)->compare(**frame, 0);
            if (!compared) return answer(compared);
            test::require(compared->same, "a frame is not the same as itself");
            test::require(!(*frame)->statistics_json().empty(), "there are no statistics");
            if (const Answer described = answer((*frame)->describe()); described.status != 0) return described;
        }
        return answer(scene->explain());
    }

    static std::vector<Hostile> hostile(Scene& scene, const Frame* frame, const Snapshot* snapshot)
    {
        std::vector<Hostile> all;
        add_openings(all);
        add_settings(all, *scene);
        add_offers(all, *scene);
        if (frame) add_frames(all, *scene, **frame);
        if (snapshot)
            for (const char* path : {"", "/dev/full/x", "/dev/full"})
                all.push_back([=] { return answer((*snapshot)->write(path)); });
        return all;
    }

private:
    static void add_openings(std::vector<Hostile>& all)
    {
        for (const char* text : {"", "return", "return 3", "error {}", "\x1bLJ", "return require 'rapid'.create { 3 }",
                                 "local function f() return f() + 1 end f()", "return ('x'):rep(1e15)", "return (((",
                                 "error(('x'):rep(1e7))"})
            all.push_back(hostile_text(text));
        SceneOptions options;
        options.threads = -1;
        all.push_back(hostile_text(test::falling_scene, options));
        options = {};
        options.script_seconds = nan;
        all.push_back(hostile_text(test::falling_scene, options));
        options = {};
        options.find_module = [](const std::string&) -> std::optional<std::string> {
            throw std::runtime_error("no modules");
        };
        all.push_back(hostile_text("return require 'mine'", options));
        options = {};
        options.log = [](LogLevel, const std::string&) { throw 3; };
        all.push_back(hostile_text("print 'x' error 'y'", options));
        for (const char* path : {"", "/", "/dev/zero", "/none.lua"}) {
            all.push_back([=] { return answer(rapid::Scene::open(path)); });
            all.push_back([=] { return answer(SceneFrame::read(path)); });
            all.push_back([=] { return answer(SceneInside::load_frame(path, "key")); });
            all.push_back([=] { return answer(SceneSnapshot::read(path)); });
            all.push_back([=] { return answer(SceneInside::describe_snapshot(path)); });
            if (*path) all.push_back([=] { return answer(rapid::Scene::load_plugin(path)); });
        }
        all.push_back([] { return answer(SceneFrame::text_of(0xffffffff)); });
        all.push_back([] { return answer(SceneFrame::token_of("\xff")); });
    }

    static void add_settings(std::vector<Hostile>& all, rapid::Scene& scene)
    {
        const std::vector<std::pair<std::string, SceneValue>> wrong = {
            {"height", "ten"},
            {"height", true},
            {"height", std::array{1.0, 2.0, 3.0}},
            {"", 1.0},
            {"height.x.y", 1.0},
            {"solve.substeps", -1.0},
            {"solve.substeps", 1e300},
            {"solve.substeps", nan},
            {"none.none", 1.0},
        };
        for (const auto& one : wrong) all.push_back([&scene, one] { return answer(scene.set({one})); });
        for (const TraceOptions& options :
             {TraceOptions{}, TraceOptions{{0}, "none"}, TraceOptions{{0}, "", 1, -5}, TraceOptions{{0}, "", 1, 2, 0}})
            all.push_back([&scene, options] { return answer(scene.trace(options)); });
        for (const auto& [node, frame] : {std::pair{"none", 2}, std::pair{"create1", -5}, std::pair{"", 2}})
            all.push_back([&scene, node = node, frame = frame] { return answer(scene.points_after(node, frame)); });
        all.push_back([&scene] { return answer(SceneInside::fingerprint(scene)); });
        all.push_back([&scene] { return answer(SceneInside::take_inputs(scene)); });
        for (const std::int64_t number : {std::int64_t{0}, std::numeric_limits<std::int64_t>::min()})
            all.push_back([&scene, number] { return answer(SceneInside::points_after_nodes(scene, number)); });
    }

    static void add_offers(std::vector<Hostile>& all, rapid::Scene& scene)
    {
        const auto offer = [&](const HostObject& object) {
            all.push_back([&scene, object] { return answer(scene.offer("thing", object)); });
        };
        for (const std::int32_t corner : {-1, 3, std::numeric_limits<std::int32_t>::max()})
            offer(HostMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, corner}}});
        static const float places[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        offer(HostPoints{3, {}});
        offer(HostPoints{3, {{"P", ColumnType::Vec3, nullptr}}});
        offer(HostPoints{3, {{"P", ColumnType::Int32, places}}});
        offer(HostPoints{3, {{"P", ColumnType{99}, places}}});
        offer(HostPoints{3, {{"Q", ColumnType::Vec3, places}}});
        offer(HostShape{});  // without a callback
    }

    static void add_frames(std::vector<Hostile>& all, rapid::Scene& scene, const SceneFrame& frame)
    {
        for (const char* name : {"", "none", "P.x", "\xff\x1b[2J"}) {
            all.push_back([=] { return answer(frame.column(name)); });
            all.push_back([=] { return answer(frame.group(name)); });
            all.push_back([=] { return answer(frame.expanded(name)); });
            all.push_back([=] { return answer(frame.output(name)); });
        }
        for (const char* path : {"", "x", "x.none", "/dev/full/x.csv", "/dev/full"})
            all.push_back([=] { return answer(frame.write(path)); });
        for (const double tolerance : {-1.0, nan})
            all.push_back([=] { return answer(frame.compare(frame, tolerance)); });
        for (const int edge : {0, -5, std::numeric_limits<int>::max()})
            all.push_back([=, &scene] { return answer(scene.picture(frame, {edge, edge})); });
        all.push_back([=, &scene] { return answer(SceneInside::origin(scene, frame, -7)); });
    }
};

}  // namespace

TEST_CASE("any sequence of calls does what the model says", "[scene][random]") { test::check_random_calls<CppFace>(); }

}  // namespace rapid
