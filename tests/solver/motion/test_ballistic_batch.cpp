// The ballistic batch, against the parabola in double precision, and against the substeps of other points.
#include "runtime/solver/motion/ballistic_batch.h"

#include <cmath>
#include <limits>
#include <random>

#include "tests/solver/scene.h"

namespace rapid {
namespace {

using test::close_to;
using test::Scene;

const Vec3d gravity(0.5, -9.81, 1);
using test::h;

struct Crowd {
    std::vector<Vec3f> P, v;
    std::vector<float> dt;

    explicit Crowd(std::size_t n, unsigned seed = 1)
    {
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> place(-1, 1), speed(-8, 8), part(0, 1);
        for (std::size_t i = 0; i < n; ++i) {
            P.push_back(Vec3f(place(random), place(random), place(random)));
            v.push_back(Vec3f(speed(random), speed(random), speed(random)));
            dt.push_back(i % 3 == 0 ? part(random) * float(h) : float(h));
        }
    }
    OwnTime time(bool own) const { return own ? OwnTime{h, {dt.data(), 1}} : OwnTime{h}; }
};

// Returns true if a parabola, sampled along its length, comes within a margin of a box.
bool comes_near(const Vec3d& P, const Vec3d& v, double t, const Box3d& box, double margin)
{
    for (int k = 0; k <= 256; ++k) {
        const double s = t * k / 256;
        if (box.exteriorDistance(Vec3d(P + s * (v + 0.5 * s * gravity))) <= margin) return true;
    }
    return false;
}

TEST_CASE("points fall along their parabolas, each for its own time", "[ballistic]")
{
    const std::size_t n = GENERATE(1, 2, 7, 8, 9, 64, 1001);
    const std::size_t begin = GENERATE(0, 5);
    const bool own = GENERATE(false, true);
    CAPTURE(n, begin, own);
    if (begin >= n) return;
    const Crowd crowd(n);
    std::vector<Vec3f> P = crowd.P, v = crowd.v;
    std::vector<std::uint32_t> near;
    BallisticBatch(gravity, 0).advance(P, v, crowd.time(own), begin, n, near);
    CHECK(near.empty());
    for (std::size_t i = 0; i < n; ++i) {
        const double t = i < begin ? 0 : crowd.time(own)(i);
        const Vec3d from = crowd.P[i].cast<double>(), speed = crowd.v[i].cast<double>();
        REQUIRE_THAT(P[i], close_to(Vec3f((from + t * (speed + 0.5 * t * gravity)).cast<float>()), 1e-7));
        REQUIRE_THAT(v[i], close_to(Vec3f((speed + t * gravity).cast<float>()), 1e-6));
    }
}

TEST_CASE("points that come near a box are not advanced, and are listed in order", "[ballistic]")
{
    const double radius = GENERATE(0.0, 0.1);
    const double away = GENERATE(0.0, 1.0, 1.2, 1.3, 1.34, 1.5, 4.0);  // the fastest move by a third of a metre
    CAPTURE(radius, away);
    const std::size_t n = 1003;
    const Crowd crowd(n);
    const Box3d boxes[] = {
        {Vec3d(away - 0.3, -0.2, -0.4), Vec3d(away + 0.1, 0.3, 0.2)},
        {Vec3d::Constant(-std::numeric_limits<double>::infinity()),
         Vec3d(std::numeric_limits<double>::infinity(), -0.9 - away, std::numeric_limits<double>::infinity())}};
    BallisticBatch batch(gravity, 0);
    for (const Box3d& box : boxes) batch.avoid(box, radius);
    std::vector<Vec3f> P = crowd.P, v = crowd.v;
    std::vector<std::uint32_t> near{42};  // earlier entries are kept
    batch.advance(P, v, crowd.time(true), 0, n, near);

    REQUIRE(near.front() == 42);
    REQUIRE(std::is_sorted(near.begin() + 1, near.end()));
    std::vector<bool> stays(n);
    for (std::size_t j = 1; j < near.size(); ++j) stays[near[j]] = true;
    std::size_t met = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const bool same = P[i] == crowd.P[i] && v[i] == crowd.v[i];
        if (stays[i]) REQUIRE(same);
        bool comes = false;
        for (const Box3d& box : boxes)
            comes |= comes_near(crowd.P[i].cast<double>(), crowd.v[i].cast<double>(), crowd.time(true)(i), box, radius);
        if (comes) REQUIRE(stays[i]);
        met += comes;
    }
    // The bounding boxes of paths are larger than the paths, but only so much that not all points are listed.
    if (away == 0) CHECK(met > 100);
    CHECK(near.size() - 1 <= 2 * met + 8);
}

// v' = gravity - k v, by its closed form; k t is large enough that it does not cancel.
struct DraggedPoint {
    Vec3d P, v;

    DraggedPoint(const Vec3d& from, const Vec3d& speed, double k, double t)
    {
        const double decay = std::exp(-k * t);
        const Vec3d end = gravity / k;
        v = end + (speed - end) * decay;
        P = from + t * end + (speed - end) * ((1 - decay) / k);
    }
};

TEST_CASE("points under drag follow the closed form, each for its own time", "[ballistic]")
{
    const double k = GENERATE(0.5, 24.0, 1e5);
    const bool own = GENERATE(false, true);
    CAPTURE(k, own);
    const std::size_t n = 1001;
    const Crowd crowd(n);
    std::vector<Vec3f> P = crowd.P, v = crowd.v;
    std::vector<std::uint32_t> near;
    BallisticBatch(gravity, k).advance(P, v, crowd.time(own), 0, n, near);
    for (std::size_t i = 0; i < n; ++i) {
        const DraggedPoint right(crowd.P[i].cast<double>(), crowd.v[i].cast<double>(), k, crowd.time(own)(i));
        REQUIRE_THAT(P[i], close_to(Vec3f(right.P.cast<float>()), 1e-7));
        REQUIRE_THAT(v[i], close_to(Vec3f(right.v.cast<float>()), 1e-6));
    }
}

TEST_CASE("points under drag that come near a box are not advanced", "[ballistic]")
{
    const double k = GENERATE(1.0, 50.0, 1000.0);
    const double away = GENERATE(0.0, 1.0, 1.1, 1.2);
    CAPTURE(k, away);
    const std::size_t n = 1003;
    const Crowd crowd(n);
    const Box3d box(Vec3d(away - 0.3, -0.2, -0.4), Vec3d(away + 0.1, 0.3, 0.2));
    BallisticBatch batch(gravity, k);
    batch.avoid(box, 0.05);
    std::vector<Vec3f> P = crowd.P, v = crowd.v;
    std::vector<std::uint32_t> near;
    batch.advance(P, v, crowd.time(true), 0, n, near);
    std::vector<bool> stays(n);
    for (const std::uint32_t i : near) stays[i] = true;
    std::size_t met = 0;
    for (std::size_t i = 0; i < n; ++i) {
        bool comes = false;
        for (int part = 0; part <= 256; ++part) {
            const double t = crowd.time(true)(i) * part / 256;
            const Vec3d at = t > 0 ? DraggedPoint(crowd.P[i].cast<double>(), crowd.v[i].cast<double>(), k, t).P
                                   : Vec3d(crowd.P[i].cast<double>());
            comes |= box.exteriorDistance(at) <= 0.05;
        }
        if (comes) REQUIRE(stays[i]);
        if (stays[i]) REQUIRE((P[i] == crowd.P[i] && v[i] == crowd.v[i]));
        met += comes;
    }
    if (away == 0) CHECK(met > 10);
    CHECK(near.size() <= 3 * met + 30);
}

TEST_CASE("under drag, points near and far from shapes have the same path", "[ballistic]")
{
    struct Air : Force {
        void contribute(const Chunk&, Forces&) const override {}
        std::optional<Uniform> uniform() const override
        {
            Uniform air{gravity};
            air.linear.k = 3;
            air.linear.ku = Vec3d(1, 2, 3);
            return air;
        }
    };
    const Crowd crowd(500);
    // The box of a plane that is not aligned with the axes is unbounded: no point is far from it, and none reaches it.
    const auto run = [&](int substeps, const Vec3d& normal) {
        PointSet set = test::points(crowd.P);
        std::copy(crowd.v.begin(), crowd.v.end(), set.v().write().begin());
        Scene scene(std::move(set));
        scene.dynamics.add(std::make_shared<Air>());
        scene.collide(make_plane(normal, -100)).substeps(substeps);
        return scene.run(4).points;
    };
    const PointSet far = run(1, {0, 1, 0}), many = run(16, {0, 1, 0}), near = run(16, {1, 1, 0});
    for (std::size_t i = 0; i < 500; ++i) {
        REQUIRE(far.P()[i] == many.P()[i]);
        REQUIRE_THAT(near.P()[i], close_to(far.P()[i], 5e-7));
        REQUIRE_THAT(near.v()[i], close_to(far.v()[i], 2e-6));
    }
}

TEST_CASE("the number of sub-steps does not change free fall by a bit", "[ballistic]")
{
    const Crowd crowd(500);
    const auto run = [&](int substeps) {
        PointSet set = test::points(crowd.P);
        std::copy(crowd.v.begin(), crowd.v.end(), set.v().write().begin());
        Scene scene(std::move(set));
        scene.gravity().collide(make_sphere_shape(0.1, {0, 50, 0})).substeps(substeps).run(1);
        return scene.points;
    };
    const PointSet one = run(1), many = run(64);
    for (std::size_t i = 0; i < 500; ++i) {
        REQUIRE(one.P()[i] == many.P()[i]);
        REQUIRE(one.v()[i] == many.v()[i]);
    }
}

}  // namespace
}  // namespace rapid
