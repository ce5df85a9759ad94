#include "runtime/operators/emit/birth_times.h"

#include <cmath>

#include "tests/test.h"

namespace rapid {
namespace {

// A number as its author means it: 0.29 is 29/100, whatever the nearest double is.
struct Fraction {
    std::int64_t over, under;
    double value() const { return static_cast<double>(over) / static_cast<double>(under); }
};

}  // namespace

TEST_CASE("a constant rate has emitted floor(rate time) points by the end of every frame", "[emit]")
{
    const Fraction rate = GENERATE(Fraction{20000, 1}, Fraction{29, 100}, Fraction{1, 3}, Fraction{1999, 100},
                                   Fraction{1000, 7}, Fraction{1, 10}, Fraction{10000000, 1}, Fraction{7, 1000000});
    const Fraction fps = GENERATE(Fraction{24, 1}, Fraction{24000, 1001}, Fraction{30, 1}, Fraction{1, 10});
    CAPTURE(rate.value(), fps.value());

    BirthClock clock(1);
    std::uint64_t borne = 0;
    bool all_right = true;
    for (std::int64_t n = 1; n <= 20000; ++n) {
        const Births births = clock.at_rate(rate.value(), 1 + n, fps.value());
        all_right &= births.first == borne;
        borne += births.count;
        const auto exact =
            static_cast<__int128>(rate.over) * n * fps.under / (static_cast<__int128>(rate.under) * fps.over);
        all_right &= borne == static_cast<std::uint64_t>(exact);
    }
    CHECK(all_right);
}

TEST_CASE("a rate that changes each frame emits the floor of its integral", "[emit]")
{
    // Rates are multiples of 1/8 and a frame is 1/16 s, so the integral is an integer number of 128ths.
    BirthClock clock(1);
    std::int64_t integral = 0;
    std::uint64_t borne = 0;
    bool all_right = true;
    for (std::int64_t n = 1; n <= 5000; ++n) {
        const std::int64_t eighths = n * n % 97 * (n % 5 != 0);
        borne += clock.at_rate(static_cast<double>(eighths) / 8, 1 + n, 16).count;
        integral += eighths;
        all_right &= borne == static_cast<std::uint64_t>(integral / 128);
    }
    CHECK(all_right);
}

TEST_CASE("no birth is lost over 100,000 changes of a rate of tenths of a birth per frame", "[emit]")
{
    // 0.1 and 0.2 births per frame have no exact double; 0.3 per pair of frames.
    BirthClock clock(1);
    std::uint64_t borne = 0;
    bool all_right = true;
    for (std::int64_t n = 1; n <= 100000; ++n) {
        borne += clock.at_rate(n % 2 ? 2.4 : 4.8, 1 + n, 24).count;
        all_right &= borne == static_cast<std::uint64_t>((n / 2 * 3 + n % 2) / 10);
    }
    CHECK(all_right);
}

TEST_CASE("births of a constant rate are evenly spaced across the frames' ends", "[emit]")
{
    const double rate = GENERATE(1.0, 7.3, 24.0, 1000.0 / 7, 20000.0, 1e7);
    const double fps = 24;
    CAPTURE(rate);

    BirthClock clock(1);
    double largest_error = 0;
    bool in_their_frames = true;
    for (std::int64_t n = 1; n <= 500; ++n) {
        const Births births = clock.at_rate(rate, 1 + n, fps);
        const double end = static_cast<double>(n) / fps;
        const std::size_t step = std::max<std::size_t>(1, births.count / 100);
        for (std::size_t i = 0; i < births.count; i += step) {
            const double born = end - births.even_age(i);
            largest_error = std::max(largest_error, std::abs(born - static_cast<double>(births.first + i + 1) / rate));
            in_their_frames &= born > static_cast<double>(n - 1) / fps - 1e-9 / rate && born <= end;
        }
    }
    CHECK(largest_error < 1e-13);  // 20 s in doubles: 4e-15 each, accumulated
    CHECK(in_their_frames);
}

TEST_CASE("a birth due at a frame's end belongs to that frame, with age 0", "[emit]")
{
    BirthClock clock(1);
    const Births births = clock.at_rate(24, 2, 24);
    REQUIRE(births.count == 1);
    CHECK(births.even_age(0) == 0.0);
}

TEST_CASE("births of a count are evenly spaced within their frame", "[emit]")
{
    BirthClock clock(1);
    const Births births = clock.at_once(4, 25);
    for (std::size_t i = 0; i < 4; ++i)
        CHECK(births.even_age(i) == Approx(0.04 * (1 - static_cast<double>(i + 1) / 4)).margin(1e-17));
}

TEST_CASE("births of a count have the same times with any number of sub-frames", "[emit]")
{
    const std::size_t count = GENERATE(0, 1, 4, 7, 1000);
    const int parts = GENERATE(1, 3, 4, 16);
    CAPTURE(count, parts);
    BirthClock clock(1);
    std::size_t born = 0;
    for (int part = 0; part < parts; ++part) {
        const Births births = clock.at_once(count, 25, part, parts);
        CHECK(births.first == born);
        for (std::size_t i = 0; i < births.count; ++i, ++born) {
            const double end = 0.04 * (part + 1) / parts;  // s, of this part
            CHECK(births.even_age(i) < 0.04 / parts);
            CHECK(end - births.even_age(i) ==
                  Approx(0.04 * static_cast<double>(born + 1) / static_cast<double>(count)).margin(1e-15));
        }
    }
    CHECK(born == count);
}

}  // namespace rapid
