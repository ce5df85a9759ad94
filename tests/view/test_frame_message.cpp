// Compares the numbers that the viewer's page receives with the points, and checks which points it gets of a large set.
#include "bindings/view/frame_message.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

using namespace rapid;

namespace {

using Triple = std::array<float, 3>;

struct Moving {
    Triple P, v;
};

std::vector<Moving> random_points(std::size_t count)
{
    std::mt19937 generator(7);
    std::uniform_real_distribution<float> any(-5, 20);
    std::vector<Moving> points(count);
    for (auto& [P, v] : points) {
        for (float& x : P) x = any(generator);
        for (float& x : v) x = any(generator);
    }
    return points;
}

SceneFrame frame_of(const std::vector<Moving>& points)
{
    const test::TemporaryFolder folder;
    std::string text = "id,Px,Py,Pz,vx,vy,vz\n";
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto& [P, v] = points[i];
        text += fmt::format("{},{},{},{},{},{},{}\n", i, P[0], P[1], P[2], v[0], v[1], v[2]);
    }
    return test::good(SceneFrame::read(folder.write("points.csv", text)));
}

class Received {
public:
    explicit Received(const std::string& message) : message_(message)
    {
        std::uint32_t length = 0;
        std::memcpy(&length, message.data() + 4, sizeof length);
        header_ = nlohmann::json::parse(message.substr(8, length));
        begin_ = 8 + length;
    }

    const nlohmann::json& header() const { return header_; }

    template <class T>
    std::vector<T> array(const std::string& name) const
    {
        const nlohmann::json& place = header_.at("arrays").at(name);
        std::vector<T> values(place.at("count").get<std::size_t>());
        const std::size_t begin = begin_ + place.at("begin").get<std::size_t>(), bytes = values.size() * sizeof(T);
        REQUIRE(begin + bytes <= message_.size());
        std::memcpy(values.data(), message_.data() + begin, bytes);
        return values;
    }

private:
    std::string message_;
    nlohmann::json header_;
    std::size_t begin_ = 0;
};

double length(const Triple& v) { return std::hypot(v[0], v[1], v[2]); }

// Ids in the order of a foreign file.
SceneFrame points_with_ids(const std::vector<std::int64_t>& ids)
{
    const test::TemporaryFolder folder;
    std::string text = "id,Px,Py,Pz\n";
    for (const std::int64_t id : ids) text += std::to_string(id) + ",0,0,0\n";
    return test::good(SceneFrame::read(folder.write("points.csv", text)));
}

}  // namespace

// Loops take 48 coordinates at once: 16 points, then the remainder.
TEST_CASE("a page gets positions, velocities and speeds within half a step, however many points there are")
{
    const std::size_t count = GENERATE(1, 15, 16, 17, 32, 101);
    const std::size_t every = GENERATE(1, 2);
    CAPTURE(count, every);
    const std::vector<Moving> points = random_points(count);
    FrameOptions frame_options;
    frame_options.velocities = true;
    frame_options.most = every == 1 ? count : (count + 1) / 2;
    const Received message(frame_message(3, frame_of(points), frame_options, CheckedJson::object()));

    std::vector<Moving> shown;
    for (std::size_t i = 0; i<count; i += count> frame_options.most ? every : 1) shown.push_back(points[i]);
    Triple low = shown[0].P, high = shown[0].P;
    double least = length(shown[0].v), most = least, fastest = 0;  // fastest: along an axis
    for (const auto& [P, v] : shown) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], P[axis]);
            high[axis] = std::max(high[axis], P[axis]);
            fastest = std::max<double>(fastest, std::abs(v[axis]));
        }
        least = std::min(least, length(v));
        most = std::max(most, length(v));
    }
    CHECK(message.header().at("shown") == shown.size());
    CHECK(message.header().at("total") == count);
    CHECK(message.header().at("box") == nlohmann::json({low, high}));
    CHECK(message.header().at("fastest").get<double>() == Approx(fastest));

    const auto P = message.array<std::uint16_t>("P");
    const auto v = message.array<std::int16_t>("v");
    const auto speed = message.array<std::uint16_t>("value");
    REQUIRE(P.size() == 3 * shown.size());
    REQUIRE(v.size() == 3 * shown.size());
    REQUIRE(speed.size() == shown.size());
    constexpr double half = 0.51;  // of a step, plus the rounding of single precision
    for (std::size_t k = 0; k < shown.size(); ++k) {
        CAPTURE(k);
        for (int axis = 0; axis < 3; ++axis) {
            const double step = (high[axis] - low[axis]) / 65535.0;
            CHECK(std::abs(low[axis] + P[3 * k + axis] * step - shown[k].P[axis]) <= half * step);
            CHECK(std::abs(v[3 * k + axis] * fastest / 32767 - shown[k].v[axis]) <= half * fastest / 32767);
        }
        const double step = (most - least) / 65535;
        CHECK(std::abs(least + speed[k] * step - length(shown[k].v)) <= half * step);
    }
}

TEST_CASE("of points above a number those are shown whose id is a multiple of a power of two")
{
    std::vector<std::int64_t> ids(100);
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i);
    const SceneFrame points = points_with_ids(ids);
    FrameOptions frame_options;
    frame_options.most = 30;
    const ShownPoints shown = shown_points(points, frame_options);
    CHECK(shown.every == 4);
    REQUIRE(shown.count == 25);
    for (std::size_t k = 0; k < shown.count; ++k)
        CHECK(*points.column("id")->at<std::int64_t>(shown[k]) == static_cast<std::int64_t>(4 * k));
}

TEST_CASE("of points that have one id, as files of others may have them, some are shown")
{
    FrameOptions frame_options;
    for (const std::int64_t id : {std::int64_t{0}, INT64_MIN, std::int64_t{1}, std::int64_t{-1}})
        for (const std::size_t most : {0, 1, 7}) {
            frame_options.most = most;
            CHECK(shown_points(points_with_ids(std::vector<std::int64_t>(20, id)), frame_options).count <= most);
        }
}

TEST_CASE("the numbers of texts are their places in the alphabet, among the points that are meant")
{
    const test::TemporaryFolder folder;
    const SceneFrame points = test::good(SceneFrame::read(folder.write(
        "points.csv",
        "id,Px,Py,Pz,vx,vy,vz,name\n0,0,0,0,3,4,0,\"pear\"\n1,0,0,0,0,0,0,\"apple\"\n2,0,0,0,0,0,2,\"pear\"\n"
        "3,0,0,0,0,0,0,\"fig\"\n")));
    CHECK(numbers_of(points, "name") == std::vector<float>{2, 0, 2, 1});
    const Indices some = {0, 3};
    CHECK(numbers_of(points, "name", &some) == std::vector<float>{1, 0});
    CHECK(numbers_of(points, "speed") == std::vector<float>{5, 0, 2, 0});
    CHECK_THROWS_WITH(numbers_of(points, "heat"), "the points have no attribute \"heat\" here");
    CHECK_THROWS_WITH(numbers_of(points, "group:low"), "the points have no group \"low\" here");
}
