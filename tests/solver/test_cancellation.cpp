// Cancellation within a frame, in both kinds of steps with substeps.
#include "runtime/base/cancellation.h"

#include <atomic>
#include <thread>

#include "tests/solver/scene.h"

namespace rapid {
namespace {

using test::points;
using test::Scene;

TEST_CASE("a step of hours ends when another thread cancels it", "[solve][threads]")
{
    const bool is_barrier = GENERATE(false, true);
    std::vector<Vec3f> positions;
    for (int i = 0; i < 20000; ++i) positions.emplace_back(0.01f * static_cast<float>(i), 1, 0);
    Scene scene(points(positions));
    std::atomic<bool> has_begun = false;
    scene.force([&](const auto&, std::size_t) {
        has_begun = true;
        return Vec3d(0, -1, 0);
    });
    scene.options.substeps = 1 << 20;
    scene.options.interacts = is_barrier;

    Cancellation cancellation;
    std::string message;
    std::thread other([&] {
        while (!has_begun) std::this_thread::yield();
        cancellation.request();
    });
    try {
        const Cancellation::Scope scope(&cancellation);
        scene.run(1);
    } catch (const Error& error) {
        message = error.what();
    }
    other.join();
    CHECK(message == Cancellation::cancelled().message());

    // Nothing is cancelled outside the scope.
    Scene next(points(positions));
    next.gravity();
    next.options.interacts = is_barrier;
    CHECK_NOTHROW(next.run(1));
}

}  // namespace
}  // namespace rapid
