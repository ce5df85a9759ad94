// The number of objects that a run of many frames keeps. A process's peak memory shows this only within a few MiB.
#include <malloc.h>
#include <tbb/global_control.h>

#include <memory>

#include "bindings/host/session.h"
#include "runtime/graph/evaluate.h"
#include "runtime/shapes/level_set/level_set.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

// Runs a graph on one thread, frame by frame.
class KeptRun {
public:
    explicit KeptRun(const std::string& text)
        : session_(folder_.write("scene.lua", "local rapid = require 'rapid'\n" + text), {}),
          plan_(session_.graph(), PlanOptions{}),
          evaluator_(plan_, [](auto&&...) {})
    {
    }

    Evaluator& evaluator() { return evaluator_; }

    // Returns the result of the first function among the nodes' arguments.
    ObjectPtr shape_at(double frame) const
    {
        for (const NodePtr& node : session_.graph().nodes)
            for (const auto& [name, value] : node->arguments)
                if (const FrameFunction* function = value.function())
                    return *function->call({frame, frame / 24, 1.0 / 24}).get<ObjectPtr>();
        FAIL("no function");
        return nullptr;
    }

private:
    const tbb::global_control one_thread_{tbb::global_control::max_allowed_parallelism, 1};
    const test::TemporaryFolder folder_;
    Session session_;
    Plan plan_;
    Evaluator evaluator_;
};

std::string ball(double voxel)
{
    return "return rapid.create {} :collide { shape = function(frame) return rapid.levelset.sphere { radius = 1 + "
           "0.001 * (frame.number % 97), voxel = " +
           std::to_string(voxel) + " }:offset(0.01) end } :solve {}";
}

std::size_t bytes_in_use()
{
    const struct mallinfo2 now = ::mallinfo2();
    return now.uordblks + now.hblkhd;
}

// Requests `frames` level sets from the function of a scene; records the maximum number alive at once, and the size of
// one.
struct Alive {
    std::size_t most = 0;
    double bytes = 0;

    Alive(const std::string& text, int frames)
    {
        const KeptRun run(text);
        std::vector<std::weak_ptr<const Object>> made;
        for (int frame = 1; frame <= frames; ++frame) {
            const std::size_t before = bytes_in_use(), alive = made.size();
            const ObjectPtr shape = run.shape_at(frame);
            std::erase_if(made, [](const auto& object) { return object.expired(); });
            if (frame > 2 && made.size() == alive) bytes = std::max(bytes, double(bytes_in_use()) - double(before));
            made.push_back(shape);
            most = std::max(most, made.size());
        }
    }
};

// Returns the maximum of the bytes in use after each frame up to `last`.
std::size_t most_bytes(Evaluator& evaluator, std::int64_t last)
{
    std::size_t most = 0;
    while (evaluator.next_frame() <= last) {
        evaluator.advance();
        most = std::max(most, bytes_in_use());
    }
    return most;
}

}  // namespace

TEST_CASE("of level sets that are another one in each frame a few are alive, not one a frame", "[kept][long]")
{
    constexpr double uncollected = 16 << 20;  // bytes below which the collector does not run
    for (const double voxel : {0.2, 0.02}) {
        // Two in the cache, one held by the caller, and uncollected ones of at most twice `uncollected`.
        const Alive few(ball(voxel), 40), many(ball(voxel), 200);
        CAPTURE(voxel, few.bytes, few.most, many.most);
        CHECK(few.bytes > 1e6);
        CHECK(many.most == few.most);
        CHECK(many.most * few.bytes < 2 * uncollected + 3 * few.bytes);
    }
}

TEST_CASE("100,000 frames of a small scene leave no more in use than 20,000", "[kept][long]")
{
    KeptRun run(R"(
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}} } }
  :points("slow", function(p) p.v = p.v * 0.5 end)
  :detail("read", function(points, frame) local heights = {} for i = 1, #points do heights[i] = frame.time end end)
  :gravity { g = function(frame) return vec3(0, -1 - frame.number % 2, 0) end }
  :collide { shape = function(frame) return rapid.shape.sphere { radius = 0.1 + frame.number % 7 / 100 } end }
  :solve {})");
    const std::size_t few = most_bytes(run.evaluator(), 20000), many = most_bytes(run.evaluator(), 100000);
    CAPTURE(few, many);
    CHECK(few > 100000);
    CHECK(many < few + (1 << 20));
}

TEST_CASE("sessions that are stopped before their libraries are loaded leave nothing in use", "[kept]")
{
    const test::TemporaryFolder folder;
    const auto file = folder.write("scene.lua", "return require 'rapid'.create {}");
    const auto stopped_session = [&] {
        SessionOptions options;
        options.interruption = std::make_shared<Interruption>();
        options.interruption->request(Error("stopped"));
        CHECK_THROWS_WITH(Session(file, std::move(options)), "stopped");
    };
    stopped_session();
    const std::size_t before = bytes_in_use();
    for (int i = 0; i < 20; ++i) stopped_session();
    CHECK(bytes_in_use() < before + 20'000);  // a Lua state has 200,000
}

}  // namespace rapid
