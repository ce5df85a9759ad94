// Packs of eight: gather and scatter by any indices, and arithmetic lane by lane.
#include "runtime/solver/constraints/contact_pack.h"

#include <cmath>
#include <vector>

#include "tests/test.h"

namespace rapid {
namespace {

constexpr Indices indices = {3, 17, 4, 15, 9, 2, 6, 5};

TEST_CASE("gather loads points and vectors by their indices, lane by lane", "[simd]")
{
    std::vector<ProjectedPoint> at(20);
    std::vector<Vec3d> v(20);
    for (int k = 0; k < 20; ++k) at[k] = {Vec3d(k, 100 + k, 200 + k), 300.0 + k}, v[k] = Vec3d(k, -k, 0.5 * k);
    const PointPack got = gather(std::span<const ProjectedPoint>(at), indices);
    const Vectors<Doubles> vectors = gather(std::span<const Vec3d>(v), indices);
    for (std::uint32_t l = 0; l < lanes; ++l) {
        CHECK(got.P[l] == at[indices[l]].P);
        CHECK(got.w[l] == at[indices[l]].w);
        CHECK(vectors[l] == v[indices[l]]);
    }
}

TEST_CASE("scatter writes the first lanes, and nothing else", "[simd]")
{
    const std::uint32_t count = GENERATE(range(1u, lanes + 1));
    CAPTURE(count);
    std::vector<ProjectedPoint> at(20, ProjectedPoint{Vec3d(1, 2, 3), 4});
    std::vector<Vec3d> v(20, Vec3d(1, 2, 3));
    PointPack to;
    for (std::uint32_t l = 0; l < lanes; ++l) to.P.set(l, Vec3d(10 + l, 20 + l, 30 + l)), to.w[l] = 40 + l;
    scatter(to, at, indices, count);
    scatter(to.P, v, indices, count);
    for (std::uint32_t k = 0; k < 20; ++k) {
        const auto l = static_cast<std::uint32_t>(std::find(indices.begin(), indices.end(), k) - indices.begin());
        const bool written = l < count;
        CHECK(at[k].P == (written ? Vec3d(10 + l, 20 + l, 30 + l) : Vec3d(1, 2, 3)));
        CHECK(at[k].w == (written ? 40 + l : 4));
        CHECK(v[k] == (written ? Vec3d(10 + l, 20 + l, 30 + l) : Vec3d(1, 2, 3)));
    }
}

TEST_CASE("arithmetic on packs is that of numbers, lane by lane", "[simd]")
{
    const Floats x = {1, -2, 3, -4, 5, 0, 7, 8};
    const Doubles wide = widen(x), root = sqrt(wide * wide + 0.25), low = least(wide, Doubles{} + 3),
                  high = most(wide, Doubles{});
    const std::uint64_t positive = bytes(wide > 0);
    for (std::uint32_t l = 0; l < lanes; ++l) {
        const double value = x[l];
        CHECK(root[l] == std::sqrt(value * value + 0.25));
        CHECK(low[l] == std::min(value, 3.0));
        CHECK(high[l] == std::max(value, 0.0));
        CHECK((positive >> 8 * l & 255) == (value > 0 ? 255u : 0u));
        CHECK(narrow(root)[l] == static_cast<float>(root[l]));
    }
    CHECK(any(wide < -3));
    CHECK_FALSE(any(wide < -4));
}

}  // namespace
}  // namespace rapid
