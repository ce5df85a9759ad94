// What every test includes: Catch2, and nothing that a single layer could not link.
#pragma once

#include <catch2/catch.hpp>
#include <limits>
#include <sstream>
#include <string>

#include "runtime/vec.h"

// How a failed check shows a vector: all digits, on one line.
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

// Compares vectors by the largest difference of a component; `tolerance` is absolute, in the vector's unit.
template <class Vec>
class CloseTo : public Catch::MatcherBase<Vec> {
public:
    CloseTo(const Vec& expected, double tolerance) : expected_(expected), tolerance_(tolerance) {}

    bool match(const Vec& actual) const override
    {
        return (actual - expected_).template cast<double>().cwiseAbs().maxCoeff() <= tolerance_;
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

}  // namespace rapid::test
