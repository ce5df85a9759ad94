#include "runtime/math/noise.h"

#include <map>
#include <random>
#include <vector>

#include "tests/test.h"

using namespace rapid;

namespace {

std::vector<Vec3d> random_positions(std::size_t n, double size)
{
    std::mt19937_64 engine(7);
    std::uniform_real_distribution<double> uniform(-size, size);
    std::vector<Vec3d> positions(n);
    for (Vec3d& P : positions) P = {uniform(engine), uniform(engine), uniform(engine)};
    return positions;
}

double root_mean_square(const std::vector<double>& values)
{
    double sum = 0;
    for (const double x : values) sum += x * x;
    return std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace

TEST_CASE("noise has the gradient that central differences find", "[noise]")
{
    const NoiseOptions options{GENERATE(0.0, 0.3, -7.6), GENERATE(1, 3), 5};
    CAPTURE(options.time, options.octaves);
    const double h = 1e-5;  // error of the differences: h²/6 of the third derivative, and 1e-16/h from rounding
    for (const Vec3d& P : random_positions(200, 20)) {
        Vec3d gradient;
        noise(P, options, &gradient);
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3d step = h * Vec3d::Unit(axis);
            const double slope = (noise(P + step, options) - noise(P - step, options)) / (2 * h);
            CHECK(gradient[axis] == Approx(slope).margin(1e-8));
        }
    }
}

TEST_CASE("curl noise neither gathers nor spreads: its divergence is 0", "[noise]")
{
    const NoiseOptions options{GENERATE(0.0, 0.3), GENERATE(1, 3), 5};
    CAPTURE(options.time, options.octaves);
    const double h = 1e-5;
    for (const Vec3d& P : random_positions(200, 20)) {
        double divergence = 0, largest = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3d step = h * Vec3d::Unit(axis);
            const double slope = (curl_noise(P + step, options) - curl_noise(P - step, options))[axis] / (2 * h);
            divergence += slope;
            largest = std::max(largest, std::abs(slope));
        }
        CHECK(std::abs(divergence) < 1e-6);
        REQUIRE(largest > 1e-4);  // otherwise 0 would be no achievement
    }
}

TEST_CASE("noise is 0 at the corners of its lattice, its gradient one of 20 there", "[noise]")
{
    std::map<std::vector<double>, int> found;
    const double scale = 1.54;
    for (int x = 0; x < 20; ++x)
        for (int y = 0; y < 20; ++y)
            for (int z = -10; z < 10; ++z) {
                Vec3d gradient;
                CHECK(noise(Vec3d(x, y, z), {}, &gradient) == 0);
                gradient *= scale;
                ++found[{std::round(gradient.x()), std::round(gradient.y()), std::round(gradient.z())}];
                CHECK((gradient - gradient.array().round().matrix()).norm() < 1e-12);
            }
    // There are twelve edge midpoints, each with probability 1/16, and eight corners, each with probability 1/32.
    CHECK(found.size() == 20);
    for (const auto& [direction, count] : found) {
        const bool corner = direction[0] != 0 && direction[1] != 0 && direction[2] != 0;
        CAPTURE(direction, count);
        CHECK(std::abs(count - (corner ? 250 : 500)) < (corner ? 80 : 110));  // 5 standard deviations
    }
}

TEST_CASE("noise stays in [-1, 1] with mean 0 and the root mean square that is promised", "[noise]")
{
    const NoiseOptions options{GENERATE(0.0, 0.5), GENERATE(1, 4), 0};
    CAPTURE(options.time, options.octaves);
    std::vector<double> values;
    double sum = 0;
    for (const Vec3d& P : random_positions(100000, 1000)) {
        values.push_back(noise(P, options));
        REQUIRE(std::abs(values.back()) <= 1);
        sum += values.back();
    }
    CHECK(std::abs(sum / 1e5) < 5 * 0.19 / std::sqrt(1e5));
    if (options.octaves == 1) CHECK(root_mean_square(values) == Approx(0.19).epsilon(0.04));
}

TEST_CASE("curl noise has a root mean square length of 1, whatever the octaves", "[noise]")
{
    const NoiseOptions options{0, GENERATE(1, 2, 5), 11};
    CAPTURE(options.octaves);
    std::vector<double> lengths;
    Vec3d sum = Vec3d::Zero();
    for (const Vec3d& P : random_positions(100000, 1000)) {
        const Vec3d curl = curl_noise(P, options);
        lengths.push_back(curl.norm());
        sum += curl;
    }
    CHECK(root_mean_square(lengths) == Approx(1).epsilon(0.01));
    CHECK(sum.norm() / 1e5 < 5 / std::sqrt(1e5));
}

TEST_CASE("noise and its curl are continuous across cells, in place and in time, with their slopes", "[noise]")
{
    const double h = 1e-7;
    const int octaves = GENERATE(1, 3);
    for (const Vec3d& inside : random_positions(50, 5)) {
        Vec3d P = inside;
        const int axis = static_cast<int>(std::abs(P.x()) * 100) % 3;
        P[axis] = std::round(P[axis]);  // on a face between two cells
        const Vec3d step = h * Vec3d::Unit(axis);
        Vec3d below, above;
        CHECK(noise(P - step, {0.4, octaves}, &below) == Approx(noise(P + step, {0.4, octaves}, &above)).margin(4e-6));
        CHECK((below - above).norm() < 1e-4);
        CHECK((curl_noise(P - step, {0.4, octaves}) - curl_noise(P + step, {0.4, octaves})).norm() < 1e-4);
        CHECK((curl_noise(P, {2 - h, octaves}) - curl_noise(P, {2 + h, octaves})).norm() < 1e-4);
        CHECK((curl_noise(P, {2, octaves}) - curl_noise(P, {2 + h, octaves})).norm() < 1e-4);
    }
}

TEST_CASE("curl noise just below a plane of its lattice is what it is on it", "[noise]")
{
    const NoiseOptions options{0.3, 3, 5};
    const double below = GENERATE(-1e-300, -7e-21, -1e-17);
    for (Vec3d P : random_positions(200, 20)) {
        const int axis = static_cast<int>(std::abs(P.sum())) % 3;
        P[axis] = 0;
        const Vec3d on = curl_noise(P, options);
        P[axis] = below;
        CHECK((curl_noise(P, options) - on).norm() < 1e-12);
        const std::vector<Vec3d> eight(8, P);
        std::vector<Vec3d> curl(8);
        curl_noise(eight, options, curl);
        CHECK((curl[0] - on).norm() < 1e-12);
    }
}

TEST_CASE("noises two cells apart, of two seeds and of two times know nothing of each other", "[noise]")
{
    std::vector<double> value, far, other_seed, later, next_axis;
    for (const Vec3d& P : random_positions(100000, 1000)) {
        value.push_back(noise(P, {}));
        far.push_back(noise(P + Vec3d(2, 0, 0), {}));
        next_axis.push_back(noise(Vec3d(P.y(), P.x(), P.z()), {}));
        other_seed.push_back(noise(P, {0, 1, 1}));
        later.push_back(noise(P, {2}));
    }
    for (const std::vector<double>& other : {far, next_axis, other_seed, later}) {
        double sum = 0;
        for (std::size_t i = 0; i < value.size(); ++i) sum += value[i] * other[i];
        const double correlation = sum / (1e5 * root_mean_square(value) * root_mean_square(other));
        CHECK(std::abs(correlation) < 5 / std::sqrt(1e5));
    }
}

TEST_CASE("noise is defined everywhere, and known to the bit", "[noise]")
{
    for (const double x : {0.5, -0.5, 1e9 + 0.25, -3e9 + 0.75, 1e16, -1e300}) {
        CAPTURE(x);
        CHECK(std::abs(noise(Vec3d(x, 0.3, x), {0.1, 2})) <= 1);
        CHECK(curl_noise(Vec3d(0.3, x, x), {0.1, 2}).allFinite());
    }
    // tests/host/test_math.lua has the same numbers.
    CHECK(noise(Vec3d(0.25, 1.5, -2.75), {}) == -0x1.a2a589f959c42p-2);
    CHECK(noise(Vec3d(100.1, -200.2, 300.3), {0.7, 3, 42}) == -0x1.1c09a79019806p-3);
    CHECK(curl_noise(Vec3d(0.25, 1.5, -2.75), {0.7, 3, 42}) ==
          Vec3d(0x1.a2af5373855c6p-1, 0x1.016a1e6919307p+0, -0x1.b8e24146f4749p-3));
}

TEST_CASE("many points at once give the bits of each alone", "[noise]")
{
    const NoiseOptions options{GENERATE(0.0, 0.3), 3, 9};
    for (const std::size_t n : {0, 1, 7, 8, 100}) {
        const std::vector<Vec3d> P = random_positions(n, 100);
        std::vector<Vec3d> curl(n);
        curl_noise(P, options, curl);
        for (std::size_t i = 0; i < n; ++i) CHECK(curl[i] == curl_noise(P[i], options));
    }
}
