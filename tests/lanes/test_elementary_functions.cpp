// Compares logarithms, powers, arc and hyperbolic functions with long double, special values with the C library, and
// eight numbers at a time with one. MATH_VALUES sets the number of random numbers.
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "runtime/math/hyperbolic.h"
#include "runtime/math/power.h"
#include "tests/amount.h"
#include "tests/test.h"

using namespace rapid;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity(),
                 no_number = std::numeric_limits<double>::quiet_NaN();

const int values = amount("MATH_VALUES", 10000);

// Returns the error in units in the last place of the value.
double error_of(double value, long double truth)
{
    const double size = std::abs(static_cast<double>(truth));
    const double unit = std::nextafter(size, infinity) - size;
    return static_cast<double>(std::abs(static_cast<long double>(value) - truth)) / unit;
}

bool same_bits(double a, double b)
{
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (std::isnan(a) && std::isnan(b));
}

// Accepts neighbours of finite values, since the C library's own error is up to one unit.
bool is_near(double a, double b)
{
    return same_bits(a, b) || (std::isfinite(a) && a != 0 && b != 0 && error_of(a, static_cast<long double>(b)) <= 1);
}

std::mt19937_64 engine(1);

double between(double least, double most) { return std::uniform_real_distribution<double>(least, most)(engine); }

// Returns the largest error of f over the numbers that `draw` returns.
template <class F, class Truth, class Draw>
double worst(const F& f, const Truth& truth, const Draw& draw)
{
    double most = 0;
    for (int k = 0; k < values; ++k) {
        const double x = draw();
        most = std::max(most, error_of(f(x), truth(static_cast<long double>(x))));
    }
    return most;
}

const double special[] = {0,      -0.0,    1,        -1,        0.5,       -0.5,       2,           -2,
                          3,      -3,      1.5,      -1.5,      1e300,     10,         -1e300,      1e308,
                          5e-324, -5e-324, infinity, -infinity, no_number, 0x1p53 + 2, -0x1p53 + 1, 1e-310,
                          1024,   709,     710,      745,       -0.7,      22,         0.25};

using Function1 = double (*)(double);
using Function2 = double (*)(double, double);

}  // namespace

// Long double has 11 bits more than double, so its own error is below 0.001 units.
TEST_CASE("natural logarithms are within 0.9 units in the last place, others and powers within 0.53",
          "[elementary][random]")
{
    const auto any_size = [] { return std::exp2(between(-1074, 1023)); };
    const auto near_one = [] { return between(0.5, 2); };
    const auto natural = [](double x) { return logarithm(x); };
    const auto true_natural = [](long double x) { return std::log(x); };
    CHECK(worst(natural, true_natural, any_size) < 0.9);
    CHECK(worst(natural, true_natural, near_one) < 0.9);
    CHECK(worst(
              logarithm10, [](long double x) { return std::log10(x); }, any_size) < 0.51);
    CHECK(worst(
              logarithm10, [](long double x) { return std::log10(x); }, near_one) < 0.51);
    for (const auto& [base, most] : {std::pair{1.0, 70.0}, {5.0, 9.0}, {500.0, 2.0}}) {
        double error = 0;
        for (int k = 0; k < values; ++k) {
            const double x = std::exp2(between(-base, base)), y = between(-most, most);
            error = std::max(error, error_of(power(x, y), std::pow(static_cast<long double>(x), y)));
        }
        INFO(base);
        CHECK(error < 0.56);
    }
}

TEST_CASE("a power that is a double is exact, and so is a logarithm that is a whole number", "[elementary][random]")
{
    for (int base = 2; base <= 40; ++base) {
        double exact = base;
        for (int exponent = 2; (exact *= base) < 0x1p53; ++exponent) {
            CHECK(power(base, exponent) == exact);
            CHECK(power(-base, exponent) == (exponent % 2 == 0 ? exact : -exact));
            CHECK(logarithm(exact, base) == exponent);
        }
    }
    for (int exponent = -1074; exponent < 1024; ++exponent) CHECK(power(2, exponent) == std::ldexp(1.0, exponent));
    double thousand = 1;
    for (int exponent = 0; exponent < 16; ++exponent, thousand *= 10) CHECK(logarithm10(thousand) == exponent);
    CHECK(power(4, 0.5) == 2);
    for (int k = 0; k < values; ++k) {
        const double x = between(-1e3, 1e3);
        REQUIRE(same_bits(power(x, 2), x * x));
        REQUIRE(same_bits(power(x, -1), 1 / x));
        REQUIRE(same_bits(power(x * x, 0.5), std::sqrt(x * x)));
    }
}

TEST_CASE("tangents are within a unit in the last place, also of large angles", "[elementary][random]")
{
    const auto true_tangent = [](long double x) { return std::tan(x); };
    for (const double most : {1.57, 100.0, 1e6}) {
        INFO(most);
        CHECK(worst(tangent, true_tangent, [&] { return between(-most, most); }) < 1);
    }
    // The x87 unit reduces angles by π in 66 bits, so large ones are compared with the C library's doubles.
    for (const auto& [own, of_library] :
         {std::pair<Function1, Function1>{sine, std::sin}, {cosine, std::cos}, {tangent, std::tan}})
        for (int k = 0; k < values; ++k) {
            const double x = std::exp2(between(20, 1023)) * (k % 2 == 0 ? 1 : -1);
            REQUIRE(is_near(own(x), of_library(x)));
        }
}

TEST_CASE("arc functions are within 0.8 units in the last place", "[elementary][random]")
{
    const auto arc = [](double x) { return arc_tangent(x); };
    CHECK(worst(
              arc, [](long double x) { return std::atan(x); }, [] { return between(-5, 5); }) < 0.8);
    CHECK(worst(
              arc, [](long double x) { return std::atan(x); }, [] { return std::exp2(between(-40, 60)); }) < 0.8);
    const auto near_end = [] { return 1 - std::exp2(between(-50, 0)); };
    for (const auto& draw :
         {std::function<double()>([] { return between(-1, 1); }), std::function<double()>(near_end)}) {
        CHECK(worst(
                  arc_sine, [](long double x) { return std::asin(x); }, draw) < 0.8);
        CHECK(worst(
                  arc_cosine, [](long double x) { return std::acos(x); }, draw) < 0.8);
    }
    for (const double size : {5.0, 0x1p-1000, 0x1p1000}) {
        double error = 0;
        for (int k = 0; k < values; ++k) {
            const double y = between(-1, 1) * size, x = between(-1, 1) * size * std::exp2(between(-20, 20));
            const auto truth = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
            error = std::max(error, error_of(arc_tangent(y, x), truth));
        }
        INFO(size);
        CHECK(error < 0.8);
    }
}

TEST_CASE("hyperbolic functions are within 0.7 units in the last place", "[elementary]")
{
    for (const double most : {0.3, 1.0, 25.0, 710.0}) {
        const auto draw = [&] { return between(-most, most); };
        INFO(most);
        CHECK(worst(
                  hyperbolic_sine, [](long double x) { return std::sinh(x); }, draw) < 0.7);
        CHECK(worst(
                  hyperbolic_cosine, [](long double x) { return std::cosh(x); }, draw) < 0.7);
        CHECK(worst(
                  hyperbolic_tangent, [](long double x) { return std::tanh(x); }, draw) < 0.7);
    }
    CHECK(std::isfinite(hyperbolic_cosine(710.4)));
}

TEST_CASE("at special values they are as C has them", "[elementary][random]")
{
    const std::pair<Function1, Function1> ones[] = {{sine, std::sin},
                                                    {cosine, std::cos},
                                                    {tangent, std::tan},
                                                    {arc_sine, std::asin},
                                                    {arc_cosine, std::acos},
                                                    {arc_tangent, std::atan},
                                                    {logarithm, std::log},
                                                    {logarithm10, std::log10},
                                                    {exponential, std::exp},
                                                    {hyperbolic_sine, std::sinh},
                                                    {hyperbolic_cosine, std::cosh},
                                                    {hyperbolic_tangent, std::tanh}};
    for (const double x : special) {
        INFO(x);
        for (const auto& [own, of_library] : ones) CHECK(is_near(own(x), of_library(x)));
        for (const double y : special) {
            INFO(y);
            CHECK(is_near(power(x, y), std::pow(x, y)));
            CHECK(is_near(arc_tangent(x, y), std::atan2(x, y)));
            const double exponent = std::clamp(std::trunc(y), -5000.0, 5000.0);
            CHECK(same_bits(times_power_of_two(x, y), std::isnan(y) ? y : std::ldexp(x, static_cast<int>(exponent))));
        }
    }
}

TEST_CASE("eight at a time logarithms and powers have the bits of one", "[elementary][random]")
{
    for (int k = 0; k < values; k += 8) {
        Doubles x, y;
        for (std::uint32_t l = 0; l < lanes; ++l) {
            x[l] = k % 3 == 0 ? special[engine() % std::size(special)] : between(0, 9);
            y[l] = k % 2 == 0 ? special[engine() % std::size(special)] : between(-9, 9);
        }
        const double exponent = special[engine() % std::size(special)];
        const Doubles powers = power(x, y), of_one_exponent = power(x, Doubles{} + exponent), logarithms = logarithm(x);
        for (std::uint32_t l = 0; l < lanes; ++l) {
            INFO(x[l] << " " << y[l]);
            REQUIRE(same_bits(powers[l], power(x[l], y[l])));
            REQUIRE(same_bits(of_one_exponent[l], power(x[l], exponent)));
            REQUIRE(same_bits(logarithms[l], logarithm(x[l])));
        }
    }
}
