#include "runtime/graph/changing_node.h"

#include <cmath>
#include <functional>

#include "tests/test.h"

namespace rapid {
namespace {

// Calls a function of the time at the ends of steps, and counts.
class Counted : public FrameFunction {
public:
    explicit Counted(std::function<Value(const Frame&)> f) : f_(std::move(f)) {}
    Value call(const Frame& frame) const override
    {
        ++calls[frame.number];
        return f_(frame);
    }
    mutable std::map<double, int> calls;

private:
    std::function<Value(const Frame&)> f_;
};

Param number(Range range = any_number())
{
    Param p;
    p.type = param_type<double>();
    p.range = range;
    return p;
}

const FrameClock clock24{24, 1, 1};

// Returns its value in the step that ends at frame 1 + step.
double at(std::function<double(double)> f, std::int64_t step, double part, bool finer = false,
          Range range = any_number())
{
    const Param param = number(range);
    const Counted function([&](const Frame& frame) { return Value(f(frame.number - 1)); });
    FrameCurve curve(param, function);
    for (std::int64_t k = 1; k <= step; ++k) curve.move_to(1 + k, clock24);
    return *curve.at(part, finer).get<double>();
}

}  // namespace

TEST_CASE("polynomials through values are those polynomials", "[frame_curve]")
{
    const auto cubic = [](double x) { return 2 - x + 3 * x * x - 0.5 * x * x * x; };
    for (const int first : {0, -1, -2}) {
        std::vector<double> values;
        for (int k = 0; k < 5; ++k) values.push_back(cubic(first + k));
        for (const double x : {0.0, 0.3, 1.0}) {
            CHECK(interpolated(values, first, 4, x) == Approx(cubic(x)));
            CHECK(interpolated(values, first, 5, x) == Approx(cubic(x)));
        }
    }
}

TEST_CASE("the numbers of a function between frames are of order 4", "[frame_curve]")
{
    const auto error = [](double w) {
        double worst = 0;
        for (int step = 4; step < 4 + static_cast<int>(6 / w); ++step)
            for (const double part : {0.1, 0.5, 0.8})
                worst = std::max(worst, std::abs(at([&](double x) { return std::sin(w * x); }, step, part) -
                                                 std::sin(w * (step - 1 + part))));
        return worst;
    };
    CHECK(error(0.25) < 1e-4);
    CHECK(std::log2(error(0.25) / error(0.125)) == Approx(4).margin(0.3));
}

TEST_CASE("the difference of the finer numbers is the error of the others", "[frame_curve]")
{
    const auto f = [](double x) { return std::exp(0.2 * x); };
    for (const int step : {1, 2, 3, 9}) {
        const double truth = f(step - 0.5), run = at(f, step, 0.5), finer = at(f, step, 0.5, true);
        CHECK((run - finer) / (run - truth) == Approx(1).margin(0.25));
    }
}

TEST_CASE("a jump is a straight line within its frame, and nothing around it", "[frame_curve]")
{
    const auto late = [](double x) { return x > 5 ? 1.0 : 0.0; };
    for (const int step : {1, 4, 5, 7, 8}) CHECK(at(late, step, 0.5) == (step > 5 ? 1 : 0));
    CHECK(at(late, 6, 0.25) == 0.25);
    CHECK(at(late, 6, 0.25, true) == 1);  // as if it had jumped when the frame began

    const auto once = [](double x) { return x == 5 ? 8.0 : 0.0; };
    CHECK(at(once, 5, 0.5) == 4);
    CHECK(at(once, 6, 0.5) == 4);
    CHECK(at(once, 4, 0.5) == 0);
    CHECK(at(once, 7, 0.5) == 0);
}

TEST_CASE("numbers between frames stay in the range of the parameter", "[frame_curve]")
{
    const auto valley = [](double x) { return (x - 4.5) * (x - 4.5) - 0.25; };  // 0 at 4 and 5
    CHECK(at(valley, 5, 0.5) == Approx(-0.25));
    CHECK(at(valley, 5, 0.5, false, at_least(0)) == 0);
}

TEST_CASE("a function is called at whole frames alone, one ahead, and at each once", "[frame_curve]")
{
    const Param param = number();
    const Counted function([](const Frame& frame) { return Value(frame.time); });
    FrameCurve curve(param, function);
    for (std::int64_t frame = 2; frame <= 20; ++frame) curve.move_to(frame, clock24);
    for (const auto& [frame, calls] : function.calls) {
        CHECK(frame == std::round(frame));
        CHECK(calls == 1);
    }
    CHECK(function.calls.begin()->first == 1);
    CHECK(function.calls.rbegin()->first == 21);
}

TEST_CASE("a function that fails for later frames, or returns no numbers, is still evaluated", "[frame_curve]")
{
    const Param param = number();
    const auto value = [&](const std::function<Value(double)>& f, std::int64_t frame, double part) {
        const Counted function([&](const Frame& now) { return f(now.number); });
        FrameCurve curve(param, function);
        for (std::int64_t k = 2; k <= frame; ++k) curve.move_to(k, clock24);
        return curve.at(part, false);
    };
    const auto short_list = [](double x) { return x <= 6 ? Value(x * x) : Value(); };
    CHECK(*value(short_list, 6, 0.5).get<double>() == Approx(5.5 * 5.5));
    const auto fails = [](double x) -> Value {
        if (x > 6) throw Error("beyond its end");
        return x * x;
    };
    CHECK(*value(fails, 6, 0.5).get<double>() == Approx(5.5 * 5.5));
    CHECK_THROWS_AS(value(fails, 7, 0.5), Error);
    CHECK(value([](double) { return Value(AttributeRef{"own"}); }, 4, 0.5).get<AttributeRef>()->name == "own");
}

TEST_CASE("vectors are interpolated by their coordinates, and steps of sub-frames as frames are", "[frame_curve]")
{
    Param param;
    param.type = param_type<Vec3d>();
    const FrameClock clock{24, 1, 4};
    const Counted function([](const Frame& frame) { return Value(Vec3d(1, frame.time, frame.time * frame.time)); });
    FrameCurve curve(param, function);
    for (std::int64_t step = 2; step <= 9; ++step) curve.move_to(step, clock);
    const double t = 7.5 / 96;
    CHECK(curve.at(0.5, false).get<Vec3d>()->isApprox(Vec3d(1, t, t * t)));
    CHECK(function.calls.count(1.25) == 1);
}

}  // namespace rapid
