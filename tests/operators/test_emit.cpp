#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <set>

#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/scatter/scatter.h"
#include "runtime/shapes/shape.h"
#include "tests/operators/node_test.h"

namespace rapid {

using namespace test;

namespace {

constexpr double h = 1.0 / 24;

Value one_point() { return ObjectPtr(source_of(points_at({{1, 2, 3}}))); }

Arguments with(Arguments base, const Arguments& more)
{
    for (const auto& [name, value] : more) base[name] = value;
    return base;
}

// Chi-square of counts that should be equal; its mean is bins - 1, its deviation sqrt(2 (bins - 1)).
double chi_square(const std::vector<double>& uniform, int bins)
{
    std::vector<double> counts(static_cast<std::size_t>(bins), 0);
    for (const double u : uniform) ++counts[static_cast<std::size_t>(std::min(bins - 1.0, std::max(0.0, u * bins)))];
    const double expected = static_cast<double>(uniform.size()) / bins;
    double sum = 0;
    for (const double count : counts) sum += (count - expected) * (count - expected) / expected;
    return sum;
}

// Returns true if values in [0, 1) are uniform within 5 deviations, as measured with 40 bins.
bool is_uniform(const std::vector<double>& values)
{
    for (const double value : values)
        if (!(value >= 0 && value < 1)) return false;
    return chi_square(values, 40) < 39 + 5 * std::sqrt(2 * 39.0);
}

// A sphere that counts how often its surface is prepared.
class CountingSphere : public Shape {
public:
    mutable int prepared = 0;

    Box3d bounds() const override { return {}; }
    void distance(std::span<const Vec3d>, std::span<double>, std::span<Vec3d>) const override {}
    void first_contact(std::span<const Path>, std::span<Contact>) const override {}
    std::shared_ptr<const Scatter> surface_scatter() const override
    {
        ++prepared;
        return scatter_on_surface(make_sphere(1, 8, Vec3d::Zero()));
    }
};

}  // namespace

TEST_CASE("a rate emits floor(rate time) points, whose ids count all births from 0", "[emit]")
{
    NodeTest emit("emit", {{"source", one_point()}, {"rate", 29.0}});
    std::int64_t next = 0;
    bool in_order = true, all_there = true;
    for (std::int64_t frame = 2; frame <= 500; ++frame) {
        const PointSet born = emit(frame);
        for (const std::int64_t id : ids_of(born)) in_order &= id == next++;
        all_there &= next == 29 * (frame - 1) / 24;
    }
    CHECK(in_order);
    CHECK(all_there);
    CHECK(emit.figures.born == static_cast<std::uint64_t>(next));
}

TEST_CASE("a rate may be a function of the frame", "[emit]")
{
    NodeTest emit("emit", {{"source", one_point()},
                           {"rate", of_frame([](const Frame& f) { return f.number < 10 ? 0.0 : 240.0; })}});
    for (std::int64_t frame = 2; frame < 10; ++frame) CHECK(emit(frame).empty());
    for (std::int64_t frame = 10; frame < 20; ++frame) CHECK(emit(frame).size() == 10);
}

TEST_CASE("count emits that many points in every frame but the first", "[emit]")
{
    NodeTest emit("emit", {{"source", one_point()}, {"count", 7.0}});
    CHECK(emit.at_start().empty());
    for (std::int64_t frame = 2; frame < 10; ++frame) CHECK(emit(frame).size() == 7);
}

TEST_CASE("an impulse emits its points only in its frames", "[emit]")
{
    NodeTest emit("emit", {{"source", one_point()}, {"impulse", numbered({{3, 100.0}, {5, 20.0}})}});
    CHECK(emit.at_start().empty());
    CHECK(emit(2).empty());
    CHECK(emit(3).size() == 100);
    CHECK(emit(4).empty());
    CHECK(emit(5).size() == 20);
    CHECK(emit(6).empty());
}

TEST_CASE("an impulse at the first frame gives points of age 0 that are not advanced", "[emit]")
{
    const std::string birth = GENERATE("random", "begin", "end", "even");
    NodeTest emit("emit", {{"source", one_point()}, {"impulse", list({5.0})}, {"birth", birth}});
    PointSet points;
    points.add(*known_attribute("age"));
    points.add(*known_attribute("birthtime"));
    const PointSet born = emit.at_start(points);
    REQUIRE(born.size() == 5);
    CHECK_FALSE(born.has("dt"));
    CHECK(values_of<float>(born, "age") == std::vector<float>(5, 0.0f));
    CHECK(values_of<float>(born, "birthtime") == std::vector<float>(5, 0.0f));
    CHECK(values_of<Vec3f>(born, "P") == std::vector<Vec3f>(5, Vec3f(1, 2, 3)));
}

TEST_CASE("nothing is born at a rate, count or impulse of 0, but the columns are there", "[emit][extreme]")
{
    const std::string family = GENERATE("rate", "count", "impulse");
    NodeTest emit("emit", {{"source", one_point()},
                           {family, family == "impulse" ? numbered({{2, 0.0}}) : Value(0.0)},
                           {"attributes", named({{"heat", 1.0}})},
                           {"life", 2.0}});
    const PointSet born = emit(2);
    CHECK(born.empty());
    CHECK(born.has("heat"));
    CHECK(born.has("life"));
}

TEST_CASE("ten million points a second are emitted, with the same birthplace for each birth number", "[emit][extreme]")
{
    NodeTest emit("emit", {{"source", ObjectPtr(make_sphere(1, 8, Vec3d::Zero()))}, {"rate", 1e7}});
    const PointSet born = emit(2);
    REQUIRE(born.size() == 10000000 / 24);
    double farthest = 0;
    for (const Vec3f& P : values_of<Vec3f>(born, "P")) farthest = std::max<double>(farthest, P.norm());
    CHECK(farthest <= 1 + 1e-6);
}

TEST_CASE("an empty set of points emits nothing", "[emit][extreme]")
{
    NodeTest emit("emit", {{"source", ObjectPtr(source_of({}))}, {"count", 5.0}});
    CHECK(emit(2).empty());
    CHECK(emit.simulation_state().next_id == 0);
}

TEST_CASE("birth = \"even\" at a rate: point k is born at (k+1)/rate, across the frames' ends", "[emit]")
{
    const double rate = GENERATE(7.3, 100.0, 1000.0 / 7);
    CAPTURE(rate);
    NodeTest emit("emit", {{"source", one_point()}, {"rate", rate}, {"birth", "even"}});
    double k = 0, largest_error = 0;
    for (std::int64_t frame = 2; frame <= 240; ++frame) {
        const PointSet born = emit(frame);
        if (born.empty()) continue;
        for (const float dt : values_of<float>(born, "dt")) {
            const double time = static_cast<double>(frame - 1) / 24 - dt;
            largest_error = std::max(largest_error, std::abs(time - ++k / rate));
        }
    }
    CHECK(k == std::floor(rate * 239 / 24));
    CHECK(largest_error < h * 0x1p-24);  // dt is a float
}

TEST_CASE("birth = \"even\" with count: point i is born at (i+1)/count of the frame", "[emit]")
{
    NodeTest emit("emit", {{"source", one_point()}, {"count", 5.0}, {"birth", "even"}});
    const std::vector<float> dt = values_of<float>(emit(7), "dt");
    REQUIRE(dt.size() == 5);
    for (std::size_t i = 0; i < 5; ++i) CHECK(dt[i] == Approx(h * (1 - (static_cast<double>(i) + 1) / 5)).margin(1e-9));
}

TEST_CASE("birth = \"begin\" needs no time of its own; \"end\" is not advanced", "[emit]")
{
    const auto born = [](const char* birth) {
        NodeTest emit("emit", {{"source", one_point()}, {"count", 3.0}, {"birth", birth}});
        return emit(2, points_at({{0, 0, 0}}));
    };
    CHECK_FALSE(born("begin").has("dt"));
    const auto whole = static_cast<float>(h);
    CHECK(values_of<float>(born("end"), "dt") == std::vector<float>{whole, 0, 0, 0});
}

TEST_CASE("birth = \"random\": ages at the frame's end are uniform in [0, h), and birthtime agrees", "[emit]")
{
    PointSet columns;
    columns.add(*known_attribute("birthtime"));
    NodeTest emit("emit", {{"source", one_point()}, {"count", 100000.0}});
    const PointSet born = emit(25, columns);
    const std::vector<float> dt = values_of<float>(born, "dt"), birthtime = values_of<float>(born, "birthtime");
    std::vector<double> fractions;
    float largest_error = 0;
    for (std::size_t i = 0; i < dt.size(); ++i) {
        fractions.push_back(dt[i] / h);
        largest_error = std::max(largest_error, std::abs(birthtime[i] + dt[i] - 1.0f));
    }
    CHECK(is_uniform(fractions));
    CHECK(largest_error < 2e-7f);
}

TEST_CASE("a point with an age above the frame's length is born at its beginning, older by the difference", "[emit]")
{
    PointSet columns;
    columns.add(*known_attribute("age"));
    columns.add(*known_attribute("birthtime"));
    NodeTest emit("emit", {{"source", one_point()}, {"count", 2.0}, {"age", 0.5}});
    const PointSet born = emit(25, columns);
    CHECK_FALSE(born.has("dt"));  // a whole frame, like all others
    for (const float age : values_of<float>(born, "age")) CHECK(age + h == Approx(0.5));
    for (const float time : values_of<float>(born, "birthtime")) CHECK(time == Approx(1 - 0.5));
}

TEST_CASE("an age given as {min, max} is uniform between them", "[emit]")
{
    PointSet columns;
    columns.add(*known_attribute("age"));
    NodeTest emit("emit", {{"source", one_point()}, {"count", 50000.0}, {"age", list({0.01, 0.11})}});
    const PointSet born = emit(2, columns);
    const std::vector<float> dt = values_of<float>(born, "dt"), age = values_of<float>(born, "age");
    std::vector<double> fractions;
    bool none_above_a_frame = true;
    for (std::size_t i = 0; i < dt.size(); ++i) {
        fractions.push_back((static_cast<double>(dt[i]) + age[i] - 0.01) / 0.1 * (1 - 1e-6));
        none_above_a_frame &= dt[i] <= static_cast<float>(h);
    }
    CHECK(is_uniform(fractions));
    CHECK(none_above_a_frame);
}

TEST_CASE("newborn points of one emitter leave the time step of older points whole", "[emit]")
{
    NodeTest first("emit", {{"source", one_point()}, {"count", 1.0}, {"birth", "end"}});
    NodeTest second("emit", {{"source", one_point()}, {"count", 1.0}, {"birth", "begin"}});
    const auto whole = static_cast<float>(h);
    CHECK(values_of<float>(second(2, first(2, points_at({{0, 0, 0}}))), "dt") == std::vector<float>{whole, 0, whole});
}

TEST_CASE("life is one number for all, uniform between two, or infinite", "[emit]")
{
    const auto born = [](Value life) {
        return NodeTest("emit", {{"source", one_point()}, {"count", 20000.0}, {"life", life}})(2);
    };
    const PointSet fixed = born(1.5);
    CHECK(fixed.column<float>("life").is_uniform());
    CHECK(fixed.column<float>("life")[0] == 1.5f);
    CHECK(!born(std::numeric_limits<double>::infinity()).has("life"));

    std::vector<double> fractions;
    for (const float life : values_of<float>(born(list({2.0, 6.0})), "life")) fractions.push_back((life - 2) / 4);
    CHECK(is_uniform(fractions));
}

TEST_CASE("spread turns velocities uniformly over the solid angle of its cone, and keeps their length", "[emit]")
{
    const double degrees = GENERATE(0.01, 20.0, 90.0, 180.0);
    const Vec3d mean = GENERATE(Vec3d(0, 2, 0), Vec3d(0, 0, -3), Vec3d(1, -2, 0.5));
    CAPTURE(degrees, mean);
    const PointSet born =
        NodeTest("emit", {{"source", one_point()}, {"count", 100000.0}, {"velocity", mean}, {"spread", degrees}})(2);

    // 1 - cos α = |v/|v| - d|²/2, which keeps its digits in a narrow cone; v itself is a float.
    const Vec3d d = mean.normalized();
    const Vec3d e1 = d.unitOrthogonal(), e2 = d.cross(e1);
    const double depth = 1 - std::cos(degrees * EIGEN_PI / 180);
    std::vector<double> heights, turns;
    double length_error = 0, highest = 0;
    for (const Vec3f& v : values_of<Vec3f>(born, "v")) {
        const Vec3d u = v.cast<double>() / mean.norm();
        length_error = std::max(length_error, std::abs(u.norm() - 1));
        heights.push_back(std::min((u - d).squaredNorm() / 2 / depth, 1 - 1e-9));
        turns.push_back(std::atan2(u.dot(e2), u.dot(e1)) / (2 * EIGEN_PI) + 0.5);
        highest = std::max(highest, (u - d).squaredNorm() / 2 / depth);
    }
    CHECK(length_error < 2e-7);
    CHECK(highest < 1 + (degrees < 1 ? 2e-3 : 1e-6));
    for (double& turn : turns) turn = std::min(turn, 1 - 1e-9);
    CHECK(is_uniform(heights));
    CHECK(is_uniform(turns));
}

TEST_CASE("speed goes along the normal, and adds to velocity", "[emit]")
{
    NodeTest emit("emit", {{"source", ObjectPtr(make_grid(2, 2, 1, Vec3d::Zero()))},
                           {"count", 100.0},
                           {"velocity", list({1.0, 0.0, 0.0})},
                           {"speed", 3.0}});
    for (const Vec3f& v : values_of<Vec3f>(emit(2), "v")) CHECK_THAT(v, close_to(Vec3f(1, 3, 0), 1e-6));
}

TEST_CASE("newborn points inherit the given fraction of the source's velocity, which spread does not turn", "[emit]")
{
    PointSet moving = points_at({{0, 0, 0}, {1, 0, 0}});
    moving.v() = Column<Vec3f>(std::span<const Vec3f>(std::vector<Vec3f>{{4, 0, 0}, {0, 0, 8}}));
    const double inherit = GENERATE(1.0, 0.5, 0.0);
    NodeTest emit("emit", {{"source", ObjectPtr(source_of(moving))},
                           {"count", 2.0},
                           {"inherit_velocity", inherit},
                           {"velocity", Vec3d(0, 1, 0)}});
    const std::vector<Vec3f> v = values_of<Vec3f>(emit(2), "v");
    const auto f = static_cast<float>(inherit);
    CHECK_THAT(v[0], close_to(Vec3f(4 * f, 1, 0), 1e-6));
    CHECK_THAT(v[1], close_to(Vec3f(0, 1, 8 * f), 1e-6));
}

TEST_CASE("a further parameter changes no random number of another one", "[emit]")
{
    const Arguments base = {{"source", ObjectPtr(make_sphere(1, 8, Vec3d::Zero()))}, {"count", 1000.0}, {"speed", 1.0}};
    const auto born = [&](const Arguments& more) { return NodeTest("emit", with(base, more))(2); };
    const Value life = list({1.0, 2.0});
    const PointSet all = born({{"life", life}, {"spread", 30.0}, {"attributes", named({{"heat", 1.0}})}});

    CHECK(values_of<float>(born({}), "dt") == values_of<float>(all, "dt"));
    CHECK(values_of<Vec3f>(born({}), "P") == values_of<Vec3f>(all, "P"));
    CHECK(values_of<float>(born({{"life", life}, {"birth", "even"}}), "life") == values_of<float>(all, "life"));
    CHECK(values_of<Vec3f>(born({{"spread", 30.0}}), "v") == values_of<Vec3f>(all, "v"));
}

TEST_CASE("births depend on the seed and the node's name, not on the frame or on other births in it", "[emit]")
{
    const Arguments arguments = {{"source", ObjectPtr(make_sphere(1, 8, Vec3d::Zero()))}, {"count", 100.0}};
    const auto places = [&](std::uint64_t seed, const char* name, std::int64_t frame) {
        return values_of<Vec3f>(NodeTest("emit", arguments, simulation(24, 1, seed), name)(frame), "P");
    };
    CHECK(places(3, "a", 2) == places(3, "a", 9));
    CHECK(places(3, "a", 2) != places(4, "a", 2));
    CHECK(places(3, "a", 2) != places(3, "b", 2));

    // 100 births in one frame equal those of ten frames of 10.
    NodeTest tenth("emit", with(arguments, {{"count", 10.0}}), simulation(24, 1, 3), "a");
    std::vector<Vec3f> in_ten;
    for (std::int64_t frame = 2; frame < 12; ++frame)
        for (const Vec3f& P : values_of<Vec3f>(tenth(frame), "P")) in_ten.push_back(P);
    CHECK(in_ten == places(3, "a", 2));
}

TEST_CASE("newborn points have the same bits on any number of threads", "[emit]")
{
    const auto born = [](int threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 7);
        PointSet result;
        tbb::task_arena(threads).execute([&] {
            result = NodeTest("emit", {{"source", ObjectPtr(make_torus(1, 0.3, 12, Vec3d::Zero()))},
                                       {"count", 50000.0},
                                       {"speed", 2.0},
                                       {"spread", 25.0},
                                       {"life", list({1.0, 2.0})}})(2);
        });
        return result;
    };
    const PointSet one = born(1);
    for (const int threads : {2, 7}) {
        const PointSet many = born(threads);
        CHECK(values_of<Vec3f>(many, "P") == values_of<Vec3f>(one, "P"));
        CHECK(values_of<Vec3f>(many, "v") == values_of<Vec3f>(one, "v"));
        CHECK(values_of<float>(many, "dt") == values_of<float>(one, "dt"));
        CHECK(values_of<float>(many, "life") == values_of<float>(one, "life"));
        CHECK(ids_of(many) == ids_of(one));
    }
}

TEST_CASE("with a count, source points are taken in order, each once for as many births", "[emit]")
{
    NodeTest emit("emit",
                  {{"source", ObjectPtr(source_of(points_at({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}})))}, {"count", 3.0}});
    for (std::int64_t frame = 2; frame < 5; ++frame)
        CHECK(values_of<Vec3f>(emit(frame), "P") == std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}});
}

TEST_CASE("a source may be a position, at which all points are born", "[emit]")
{
    NodeTest emit("emit", {{"source", list({1.0, 2.0, 3.0})}, {"count", 2.0}});
    CHECK(values_of<Vec3f>(emit(2), "P") == std::vector<Vec3f>{{1, 2, 3}, {1, 2, 3}});
    NodeTest same("emit", {{"source", Vec3d(1, 2, 3)}, {"count", 2.0}});
    CHECK(values_of<Vec3f>(same(2), "P") == values_of<Vec3f>(emit(3), "P"));
}

TEST_CASE("with a rate, each birth takes a source point at random, uniformly", "[emit]")
{
    std::vector<Vec3f> places;
    for (int i = 0; i < 40; ++i) places.push_back(Vec3f(static_cast<float>(i), 0, 0));
    NodeTest emit("emit", {{"source", ObjectPtr(source_of(points_at(places)))}, {"rate", 24 * 40000.0}});
    std::vector<double> fractions;
    for (const Vec3f& P : values_of<Vec3f>(emit(2), "P")) fractions.push_back((P.x() + 0.5) / 40);
    CHECK(is_uniform(fractions));
}

TEST_CASE("newborn points have the given attributes and join the group; older points do not", "[emit]")
{
    NodeTest emit("emit", {{"source", one_point()},
                           {"count", 2.0},
                           {"group", "hot"},
                           {"attributes", named({{"heat", 3.0}, {"Cd", list({1.0, 0.5, 0.0})}, {"pscale", 0.1}})}});
    const PointSet points = emit(2, points_at({{0, 0, 0}}));
    CHECK(values_of<float>(points, "heat") == std::vector<float>{0, 3, 3});
    CHECK(values_of<Vec3f>(points, "Cd") == std::vector<Vec3f>{{1, 1, 1}, {1, 0.5f, 0}, {1, 0.5f, 0}});
    CHECK(values_of<float>(points, "pscale") == std::vector<float>{0, 0.1f, 0.1f});
    const Column<std::uint8_t>& hot = *points.find_group("hot");
    CHECK((hot[0] == 0 && hot[1] == 1 && hot[2] == 1));
}

TEST_CASE("values that all newborn points share stay uniform columns", "[emit]")
{
    NodeTest emit("emit", {{"source", one_point()},
                           {"count", 5.0},
                           {"group", "hot"},
                           {"life", 2.0},
                           {"velocity", Vec3d(0, 1, 0)},
                           {"attributes", named({{"pscale", 0.1}})}});
    const PointSet points = emit(3, emit(2));
    REQUIRE(points.size() == 10);
    CHECK(points.column<float>("pscale").is_uniform());
    CHECK(points.column<float>("life").is_uniform());
    CHECK(points.v().is_uniform());
    CHECK(points.find_group("hot")->is_uniform());
    CHECK(points.column<float>("pscale")[9] == 0.1f);
    CHECK(points.v()[9] == Vec3f(0, 1, 0));
    CHECK((*points.find_group("hot"))[9] == 1);
}

TEST_CASE("newborn points inherit the source's attributes, except those that every point sets itself", "[emit]")
{
    PointSet from = points_at({{0, 0, 0}, {1, 0, 0}});
    from.set("heat", Column<float>(std::span<const float>(std::vector<float>{5, 6})));
    from.set("age", Column<float>(2, 9.0f));
    from.set("kind", Column<std::int32_t>(2, 4));
    NodeTest emit("emit",
                  {{"source", ObjectPtr(source_of(from))}, {"count", 2.0}, {"attributes", named({{"kind", 1.0}})}});
    const PointSet born = emit(2);
    CHECK(values_of<float>(born, "heat") == std::vector<float>{5, 6});
    CHECK(values_of<float>(born, "kind") == std::vector<float>{1, 1});
    CHECK_FALSE(born.has("age"));
}

TEST_CASE("newborn points interpolate a mesh's attributes by barycentric weights", "[emit]")
{
    auto mesh = std::make_shared<Mesh>(*make_torus(1, 0.4, 9, Vec3d(1, 2, 3)));
    const Vec3f slope(2, -1, 0.5f);
    std::vector<float> heat;
    std::vector<Vec3f> Cd;
    for (const Vec3f& P : mesh->positions) {
        heat.push_back(slope.dot(P) + 7);
        Cd.push_back(Vec3f(P.z(), P.x(), P.y()));
    }
    mesh->values["heat"] = heat;
    mesh->values["Cd"] = Cd;
    NodeTest emit("emit", {{"source", ObjectPtr(mesh)}, {"count", 1000.0}});
    const PointSet born = emit(2);

    // A linear function of the corners equals that function of the position, for any weights.
    float largest_error = 0;
    for (std::size_t i = 0; i < born.size(); ++i) {
        const Vec3f& P = born.P()[i];
        largest_error = std::max(largest_error, std::abs(born.column<float>("heat")[i] - (slope.dot(P) + 7)));
        largest_error =
            std::max(largest_error, (born.column<Vec3f>("Cd")[i] - Vec3f(P.z(), P.x(), P.y())).cwiseAbs().maxCoeff());
    }
    CHECK(largest_error < 5e-6f);
}

TEST_CASE("from = \"points\" of a mesh emits at its vertices, along their normals", "[emit]")
{
    const MeshPtr sphere = make_sphere(2, 16, Vec3d::Zero());
    NodeTest emit("emit", {{"source", ObjectPtr(sphere)},
                           {"from", "points"},
                           {"count", static_cast<double>(sphere->positions.size())},
                           {"speed", 1.0}});
    const PointSet born = emit(2);
    CHECK(values_of<Vec3f>(born, "P") == sphere->positions);
    double straightest = 1;
    for (std::size_t i = 0; i < born.size(); ++i)
        straightest = std::min<double>(straightest, born.v()[i].dot(born.P()[i]) / 2);
    CHECK(straightest > 0.99);  // for a sphere with 16 divisions
}

TEST_CASE("from = \"volume\" of a mesh emits inside it", "[emit]")
{
    NodeTest emit(
        "emit",
        {{"source", ObjectPtr(make_box(Vec3d(1, 2, 4), Vec3d::Zero()))}, {"from", "volume"}, {"count", 20000.0}});
    std::vector<double> x, y, z;
    for (const Vec3f& P : values_of<Vec3f>(emit(2), "P")) {
        x.push_back((P.x() + 0.5) * (1 - 1e-9));
        y.push_back((P.y() + 1) / 2 * (1 - 1e-9));
        z.push_back((P.z() + 2) / 4 * (1 - 1e-9));
    }
    CHECK(is_uniform(x));
    CHECK(is_uniform(y));
    CHECK(is_uniform(z));
}

TEST_CASE("a source is prepared once, and again when it changes", "[emit]")
{
    const auto first = std::make_shared<CountingSphere>(), second = std::make_shared<CountingSphere>();
    NodeTest emit("emit",
                  {{"source", of_frame([&](const Frame& f) { return ObjectPtr(f.number < 5 ? first : second); })},
                   {"count", 1.0}});
    for (std::int64_t frame = 2; frame < 10; ++frame) CHECK(emit(frame).size() == 1);
    CHECK(first->prepared == 1);
    CHECK(second->prepared == 1);
}

TEST_CASE("emit declares what it makes, so that the columns exist from the first frame on", "[emit]")
{
    PointSet from = points_at({{0, 0, 0}});
    from.set("N", Column<Vec3f>(1, Vec3f(0, 1, 0)));
    NodeTest emit("emit", {{"source", ObjectPtr(source_of(from))},
                           {"rate", 1.0},
                           {"life", 1.0},
                           {"group", "hot"},
                           {"attributes", named({{"heat", 5.0}, {"mass", 3.0}})}});
    const Uses uses = emit.uses();
    std::map<std::string, AttributeValue> made;
    for (const AttributeSpec& spec : uses.makes) made[spec.name] = spec.fallback;
    CHECK(made.size() == 3);
    CHECK(std::get<float>(made.at("heat")) == 0);
    CHECK(std::get<float>(made.at("mass")) == 1);  // the mass of points that emit did not create
    CHECK(std::get<Vec3f>(made.at("N")) == Vec3f::Zero());
    CHECK(uses.makes_groups == std::vector<std::string>{"hot"});
    CHECK(std::count(uses.gives.begin(), uses.gives.end(), "life") == 1);
}

TEST_CASE("emit makes no pruned attribute, and emits the same points", "[emit]")
{
    PointSet from = points_at({{0, 0, 0}, {1, 0, 0}});
    const std::vector<Vec3f> normals = {{0, 1, 0}, {1, 0, 0}};
    from.set("N", Column<Vec3f>(std::span<const Vec3f>(normals)));
    const Arguments arguments = {{"source", ObjectPtr(source_of(from))},
                                 {"count", 3.0},
                                 {"life", list({1.0, 2.0})},
                                 {"group", "hot"},
                                 {"spread", 10.0},
                                 {"velocity", Vec3d(1, 0, 0)},
                                 {"attributes", named({{"heat", 5.0}})}};
    NodeTest pruned("emit", arguments), whole("emit", arguments);
    pruned.pruned = {"N", "age", "group:hot", "heat", "life"};
    const PointSet some = pruned(2), all = whole(2);
    CHECK(some.column_names() == std::vector<std::string>{"P", "dt", "id", "v"});
    CHECK(some.group_names().empty());
    CHECK(all.column_names() == std::vector<std::string>{"N", "P", "age", "dt", "heat", "id", "life", "v"});
    CHECK(all.group_names() == std::vector<std::string>{"hot"});
    CHECK(values_of<Vec3f>(some, "P") == values_of<Vec3f>(all, "P"));
    CHECK(values_of<Vec3f>(some, "v") == values_of<Vec3f>(all, "v"));
    CHECK(values_of<float>(some, "dt") == values_of<float>(all, "dt"));
}

TEST_CASE("an infinite life needs neither life nor age, unless it is a function of the frame", "[emit]")
{
    const double forever = std::numeric_limits<double>::infinity();
    const auto gives_life = [&](Value life, bool function) {
        NodeTest emit("emit", {{"source", one_point()}, {"count", 1.0}, {"life", std::move(life)}});
        const Uses uses = emit.uses(function ? std::set<std::string>{"life"} : std::set<std::string>());
        return std::count(uses.gives.begin(), uses.gives.end(), "life") == 1;
    };
    CHECK(gives_life(2.0, false));
    CHECK_FALSE(gives_life(forever, false));
    CHECK(gives_life(forever, true));
}

TEST_CASE("emit refuses illegal arguments, and names legal ones", "[emit]")
{
    const ObjectPtr mesh = make_sphere(1, 8, Vec3d::Zero());
    const auto refusal = [&](Arguments arguments, Value source) {
        arguments["source"] = std::move(source);
        return error_of([&] { NodeTest("emit", arguments)(2); });
    };
    const Value nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(refusal({}, mesh) == "the number of points is missing; give rate, count or impulse");
    CHECK(refusal({{"rate", 1.0}, {"count", 1.0}}, mesh) == "rate and count are given together; give only one of them");
    CHECK(refusal({{"rate", 1.0}, {"count", 1.0}, {"impulse", list({1.0})}}, mesh) ==
          "rate, count and impulse are given together; give only one of them");
    CHECK(refusal({{"rate", nan}}, mesh) == "rate = nan is out of range; it must be at least 0");
    CHECK(refusal({{"rate", -1.0}}, mesh) == "rate = -1 is out of range; it must be at least 0");
    CHECK(refusal({{"rate", 1e30}}, mesh) ==
          "rate = 1e+30 would emit 4.17e+28 points in a frame; at most 2147483647 are possible");
    CHECK(refusal({{"count", 1.5}}, mesh) == "count = 1.5 is not whole; it must be an integer");
    CHECK(refusal({{"impulse", list({0.5})}}, mesh) == "impulse[1] = 0.5 is not whole; it must be a number of points");
    CHECK(refusal({{"rate", 1.0}, {"birth", "evne"}}, mesh) == "birth = \"evne\" is unknown; did you mean \"even\"?");
    CHECK(refusal({{"rate", 1.0}, {"life", list({2.0, 1.0})}}, mesh) ==
          "life = {2, 1} is in the wrong order; it must be {min, max}");
    CHECK(refusal({{"rate", 1.0}, {"life", "long"}}, mesh) ==
          "life = \"long\" has the wrong type; it must be a number or {min, max}");
    CHECK(refusal({{"rate", 1.0}, {"spread", 200.0}}, mesh) ==
          "spread = 200 is out of range; it must be from 0 to 180");
    CHECK(refusal({{"rate", 1.0}, {"from", "volume"}, {"speed", 2.0}}, mesh) ==
          "speed = 2 needs a normal N, which a volume does not have; give velocity instead");
    CHECK(refusal({{"rate", 1.0}, {"speed", 2.0}}, one_point()) ==
          "speed = 2 needs a normal N, which this set of points does not have; give velocity instead");
    CHECK(refusal({{"rate", 1.0}, {"from", "surface"}}, one_point()) ==
          "from = \"surface\" needs a mesh or a shape; for points give \"points\"");
    CHECK(refusal({{"rate", 1.0}}, 5.0) ==
          "source = 5 has the wrong type; it must be a mesh, level set, shape, fog, curve, points or vec3");
    CHECK(refusal({{"rate", 1.0}, {"attributes", named({{"id", 1.0}})}}, mesh).find("\"id\"") != std::string::npos);
    CHECK(refusal({{"rate", 1.0}, {"attributes", named({{"life", 1.0}})}}, mesh) ==
          "attributes: \"life\" can't be given; use the parameter life");
}

TEST_CASE("an impulse before the first frame is refused by name", "[emit]")
{
    NodeTest emit("emit", {{"source", one_point()}, {"impulse", numbered({{-3, 5.0}})}});
    CHECK(error_of([&] { emit.at_start(); }) == "impulse[-3] is before the first frame; frames begin at 1");
}

}  // namespace rapid
