// Opens graphs/first.lua, puts a ball of its own in the place of the torus, and prints the mean height of the beads.
//
//     first_cpp graphs/first.lua
#include <rapid/scene.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace {

constexpr std::array<double, 3> center = {0, 0.7, 0};  // m
constexpr double radius = 0.7;

void ball(std::size_t n, const double* P, double* phi, double* gradient)
{
    for (std::size_t i = 0; i < n; ++i, P += 3) {
        const double d[] = {P[0] - center[0], P[1] - center[1], P[2] - center[2]};
        const double length = std::hypot(d[0], d[1], d[2]);
        phi[i] = length - radius;
        if (gradient)
            for (int axis = 0; axis < 3; ++axis) gradient[3 * i + axis] = length > 0 ? d[axis] / length : 0;
    }
}

int fail(const rapid::SceneError& error)
{
    std::fprintf(stderr, "%s\n", error.text().c_str());
    return 1;
}

}  // namespace

int main(int count, char** arguments)
{
    rapid::HostShape shape;
    shape.lower = {-0.7, 0, -0.7};
    shape.upper = {0.7, 1.4, 0.7};
    shape.distance = ball;
    rapid::SceneOptions options;
    options.objects = {{"ball", shape}};
    options.set = {{"rate", 5000.0}, {"collide1.shape", std::string("host:ball")}};
    options.log = [](rapid::LogLevel, const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };

    auto scene = rapid::Scene::open(count > 1 ? arguments[1] : "graphs/first.lua", std::move(options));
    if (!scene) return fail(scene.error());
    for (int number = 24; number <= 96; number += 24) {
        const auto frame = scene->advance_to(number);
        if (!frame) return fail(frame.error());
        const auto P = frame->column("P");
        if (!P) return fail(P.error());
        double sum = 0, nearest = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < P->count; ++i) {
            const float* at = P->at<float>(i);
            sum += at[1];
            nearest = std::min(nearest, std::hypot(at[0] - center[0], at[1] - center[1], at[2] - center[2]));
        }
        std::printf("frame %d: %zu points, mean height %.4f m, nearest to the ball's middle %.3f m\n", number, P->count,
                    P->count ? sum / static_cast<double>(P->count) : 0, nearest);
    }
}
