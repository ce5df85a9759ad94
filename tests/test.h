// Included by every test: Catch2, RapidCheck's rc::prop, comparisons of vectors within a tolerance, short constructors
// of point sets, and bitwise comparisons of columns.
#pragma once

#include <rapidcheck/catch.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/points/point_set.h"

// A failed check prints a vector with all digits, on one line.
namespace Catch {

template <class Scalar>
struct StringMaker<Eigen::Matrix<Scalar, 3, 1>> {
    static std::string convert(const Eigen::Matrix<Scalar, 3, 1>& v)
    {
        std::ostringstream text;
        text.precision(std::numeric_limits<Scalar>::max_digits10);
        text << '{' << v[0] << ", " << v[1] << ", " << v[2] << '}';
        return text.str();
    }
};

}  // namespace Catch

namespace rapid::test {

// RapidCheck generates the same cases in each run, unless RC_PARAMS requests others.
inline const bool has_fixed_seed = setenv("RC_PARAMS", "seed=1", /*overwrite=*/0) == 0;

// Compares vectors by the largest difference of a component; `tolerance` is absolute, in the vector's unit. NaN is
// never close.
template <class Vec>
class CloseTo : public Catch::MatcherBase<Vec> {
public:
    CloseTo(const Vec& expected, double tolerance) : expected_(expected), tolerance_(tolerance) {}

    bool match(const Vec& actual) const override
    {
        return ((actual - expected_).template cast<double>().array().abs() <= tolerance_).all();
    }

    std::string describe() const override
    {
        return "is within " + Catch::Detail::stringify(tolerance_) + " of " + Catch::Detail::stringify(expected_);
    }

private:
    Vec expected_;
    double tolerance_;
};

inline CloseTo<Vec3f> close_to(const Vec3f& expected, double tolerance) { return {expected, tolerance}; }
inline CloseTo<Vec3d> close_to(const Vec3d& expected, double tolerance) { return {expected, tolerance}; }

// A vector that {} initialises to zero. Eigen's default constructor leaves it uninitialised.
struct InitialisedVec3f : Vec3f {
    InitialisedVec3f() : Vec3f(Vec3f::Zero()) {}
    InitialisedVec3f(float x, float y, float z) : Vec3f(x, y, z) {}
    InitialisedVec3f(const Vec3f& value) : Vec3f(value) {}
};
template <class T>
using Initialised = std::conditional_t<std::is_same_v<T, Vec3f>, InitialisedVec3f, T>;

// A point set with ids from 0: points({{0, 1, 0}, {0, 2, 0}}).v({{0, -3, 0}, {}}).set<float>("heat", {1,
// 2}).group("hot", {1}).
class Points : public PointSet {
public:
    explicit Points(std::initializer_list<InitialisedVec3f> positions)
        : Points(std::vector<Vec3f>(positions.begin(), positions.end()))
    {
    }
    explicit Points(const std::vector<Vec3f>& positions)
    {
        append(positions.size());
        P() = Column<Vec3f>(std::span(positions));
        auto ids = id().overwrite();
        for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i);
    }

    using PointSet::v;
    Points& v(std::initializer_list<InitialisedVec3f> velocities) { return set<Vec3f>("v", velocities); }
    Points& v(const std::vector<Vec3f>& velocities) { return set<Vec3f>("v", velocities); }

    using PointSet::set;
    template <class T>
    Points& set(std::string_view name, std::initializer_list<Initialised<T>> values)
    {
        return set<T>(name, std::vector<T>(values.begin(), values.end()));
    }
    template <class T>
    Points& set(std::string_view name, const std::vector<T>& values)
    {
        PointSet::set(name, Column<T>(std::span(values)));
        return *this;
    }

    // The members are indices into the set, from 0.
    using PointSet::group;
    Points& group(std::string_view name, std::initializer_list<std::size_t> members)
    {
        auto membership = PointSet::group(name).write();
        for (const std::size_t member : members) membership[member] = 1;
        return *this;
    }
};

inline Points points(std::initializer_list<InitialisedVec3f> positions) { return Points(positions); }
inline Points points(const std::vector<Vec3f>& positions) { return Points(positions); }

// Returns true if two columns are bitwise equal, NaN and -0 included.
template <class T>
bool same_bits(const Column<T>& a, const Column<T>& b)
{
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::memcmp(&a[i], &b[i], sizeof(T)) != 0) return false;
    return true;
}

}  // namespace rapid::test
