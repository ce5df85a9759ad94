// Compares sin, cos and exp with long double, and eight numbers at a time with one.
#include <cmath>
#include <limits>
#include <random>

#include "runtime/math/elementary.h"
#include "tests/test.h"

using namespace rapid;

namespace {

// Returns the error in units in the last place of the value.
double error_of(double value, long double truth)
{
    const double size = std::abs(static_cast<double>(truth));
    const double unit = std::nextafter(size, std::numeric_limits<double>::infinity()) - size;
    return static_cast<double>(std::abs(static_cast<long double>(value) - truth)) / unit;
}

bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

// Checks x in each lane, with other numbers in the other lanes.
bool is_alike_in_lanes(double (*one)(double), Doubles (*eight)(const Doubles&), double x)
{
    for (std::uint32_t l = 0; l < lanes; ++l) {
        Doubles pack = {0, -1, 1e-300, 1e300, 700, -0.0, 3, 1e6};
        pack[l] = x;
        const double value = one(x);
        if (!same_bits(eight(pack)[l], value) && !(std::isnan(value) && std::isnan(eight(pack)[l]))) return false;
    }
    return true;
}

bool is_alike_together(double x)
{
    const auto [s, c] = sine_and_cosine(x);
    return std::isnan(s) ? std::isnan(sine(x)) : same_bits(s, sine(x)) && same_bits(c, cosine(x));
}

Doubles sine_of_eight(const Doubles& x) { return sine(x); }
Doubles cosine_of_eight(const Doubles& x) { return cosine(x); }
Doubles exponential_of_eight(const Doubles& x) { return exponential(x); }

}  // namespace

TEST_CASE("sine, cosine and the exponential function are within 0.9 units in the last place", "[elementary]")
{
    std::mt19937_64 engine(1);
    for (const double most : {1e-300, 1e-8, 0.8, 6.3, 100.0, 1e4, 1048576.0}) {
        std::uniform_real_distribution<double> angle(-most, most);
        double of_sine = 0, of_cosine = 0;
        for (int k = 0; k < 20000; ++k) {
            const double x = angle(engine);
            of_sine = std::max(of_sine, error_of(sine(x), std::sin(static_cast<long double>(x))));
            of_cosine = std::max(of_cosine, error_of(cosine(x), std::cos(static_cast<long double>(x))));
        }
        INFO(most);
        CHECK(of_sine < 0.9);
        CHECK(of_cosine < 0.9);
    }
    for (const double most : {1e-8, 1.0, 50.0, 708.0}) {
        std::uniform_real_distribution<double> power(-most, most);
        double worst = 0;
        for (int k = 0; k < 20000; ++k) {
            const double x = power(engine);
            worst = std::max(worst, error_of(exponential(x), std::exp(static_cast<long double>(x))));
        }
        INFO(most);
        CHECK(worst < 0.9);
    }
}

TEST_CASE("near quarter turns, where all digits of an angle cancel, a sine is as exact", "[elementary]")
{
    // Reduces the angle by hand, because long double's own rest has an error of n 2^-98.
    constexpr long double quarter = 1.57079632679489661923132169163975144L;
    for (int n = 1; n < 600000; n += n / 7 + 1) {
        const double x = static_cast<double>(static_cast<long double>(n) * quarter);
        // x - n quarter turns, with a quarter turn in two parts. The first has 32 bits, so its product is exact.
        constexpr long double high = 0x1.921fb544p+0L, low = 0x1.0b4611a62633145c06e0e69p-34L;
        const long double rest = (static_cast<long double>(x) - n * high) - n * low;
        const long double truth = n % 4 == 0 ? rest : n % 4 == 1 ? -rest : n % 4 == 2 ? -rest : rest;
        const double value = n % 2 == 0 ? sine(x) : cosine(x);
        INFO(n);
        CHECK(std::abs(static_cast<long double>(value) - truth) <= 1e-15L * std::abs(truth) + n * 0x1p-97L);
    }
}

TEST_CASE("at the ends of its range the exponential function is 0, infinite, or below the least normal number",
          "[elementary]")
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    CHECK(exponential(0.0) == 1);
    CHECK(exponential(709.8) == infinity);
    CHECK(exponential(infinity) == infinity);
    CHECK(exponential(1e300) == infinity);
    CHECK(exponential(-746.0) == 0);
    CHECK(exponential(-infinity) == 0);
    CHECK(exponential(-745.13) == std::numeric_limits<double>::denorm_min());
    CHECK(exponential(709.78) == Approx(std::exp(709.78)).epsilon(1e-15));
    CHECK(std::abs(exponential(-740.0) - std::exp(-740.0)) <= std::numeric_limits<double>::denorm_min());
    CHECK(std::isnan(exponential(std::numeric_limits<double>::quiet_NaN())));
    CHECK(same_bits(sine(-0.0), -0.0));
    CHECK(std::isnan(sine(infinity)));
    CHECK(std::isnan(cosine(-infinity)));
    CHECK(sine(1e9) == std::sin(1e9));
}

TEST_CASE("eight at a time, or sine and cosine together, they have the bits of one", "[elementary]")
{
    rc::prop("any number", [](double x) {
        RC_ASSERT(is_alike_together(x));
        RC_ASSERT(is_alike_in_lanes(sine, sine_of_eight, x));
        RC_ASSERT(is_alike_in_lanes(cosine, cosine_of_eight, x));
        RC_ASSERT(is_alike_in_lanes(exponential, exponential_of_eight, x));
    });
    std::mt19937_64 engine(2);
    for (const double most : {1.0, 1000.0, 2e6}) {
        std::uniform_real_distribution<double> numbers(-most, most);
        for (int k = 0; k < 2000; ++k) {
            const double x = numbers(engine);
            REQUIRE(is_alike_together(x));
            REQUIRE(is_alike_in_lanes(sine, sine_of_eight, x));
            REQUIRE(is_alike_in_lanes(cosine, cosine_of_eight, x));
            REQUIRE(is_alike_in_lanes(exponential, exponential_of_eight, x));
        }
    }
}
