// Compares operators and functions of lanes with C++, at special values and at random ones. MATH_VALUES sets the number
// of random values.
#include <cmath>
#include <limits>
#include <random>

#include "runtime/lanes/lane_program.h"
#include "runtime/math/elementary.h"
#include "runtime/math/power.h"
#include "tests/amount.h"
#include "tests/test.h"

using namespace rapid;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity(),
                 no_number = std::numeric_limits<double>::quiet_NaN();

// Returns the results of an operation for all pairs of x and y.
std::vector<double> results_of(const std::string& name, std::vector<double> x, std::vector<double> y)
{
    LaneProgram program;
    const std::uint16_t a = 5, b = 6, result = 7;
    program.code = {{lane_operation("LoadDouble"), a, 0, 0, 0, 0},
                    {lane_operation("LoadDouble"), b, 0, 0, 0, 1},
                    {lane_operation(name), result, a, b, 0, 0},
                    {lane_operation("StoreDoubleVector"), 0, result, result, result, 2}};
    program.slots = 8;
    std::vector<double> into(3 * x.size());
    const LaneChunk::Memory memory[] = {
        {x.data(), sizeof(double)}, {y.data(), sizeof(double)}, {into.data(), 3 * sizeof(double)}};
    LaneChunk chunk;
    chunk.size = x.size();
    chunk.columns = memory;
    LaneRunner().run(program, chunk, [](std::size_t, std::size_t) { FAIL(); });
    std::vector<double> results(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) results[i] = into[3 * i];
    return results;
}

double flag(bool is_set) { return std::bit_cast<double>(-std::int64_t{is_set}); }

// Returns NaN if either number is NaN, and +0 for zeros.
double extreme(double a, double b, double chosen) { return std::isnan(a) || std::isnan(b) ? no_number : chosen + 0.0; }

using Function = double (*)(double, double);

const std::pair<std::string, Function> operations[] = {
    {"Add", [](double a, double b) { return a + b; }},
    {"Subtract", [](double a, double b) { return a - b; }},
    {"Multiply", [](double a, double b) { return a * b; }},
    {"Divide", [](double a, double b) { return a / b; }},
    {"Modulo", [](double a, double b) { return a - std::floor(a / b) * b; }},
    {"Negate", [](double a, double) { return -a; }},
    {"SquareRoot", [](double a, double) { return std::sqrt(a); }},
    {"Absolute", [](double a, double) { return std::fabs(a); }},
    {"Floor", [](double a, double) { return std::floor(a); }},
    {"Ceiling", [](double a, double) { return std::ceil(a); }},
    {"Least", [](double a, double b) { return extreme(a, b, b < a ? b : a); }},
    {"Most", [](double a, double b) { return extreme(a, b, b > a ? b : a); }},
    {"Sine", [](double a, double) { return sine(a); }},
    {"Cosine", [](double a, double) { return cosine(a); }},
    {"Exponential", [](double a, double) { return exponential(a); }},
    {"Logarithm", [](double a, double) { return logarithm(a); }},
    {"Power", [](double a, double b) { return power(a, b); }},
    {"Round", [](double a, double) { return static_cast<double>(static_cast<float>(a)); }},
    {"Less", [](double a, double b) { return flag(a < b); }},
    {"LessOrEqual", [](double a, double b) { return flag(a <= b); }},
    {"Equal", [](double a, double b) { return flag(a == b); }},
};

bool same_bits(double a, double b)
{
    const bool is_flag = std::bit_cast<std::int64_t>(b) == -1;
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
           (std::isnan(a) && std::isnan(b) && !is_flag);
}

void check(const std::vector<double>& x, const std::vector<double>& y)
{
    for (const auto& [name, reference] : operations) {
        const std::vector<double> results = results_of(name, x, y);
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double expected = reference(x[i], y[i]);
            if (same_bits(results[i], expected)) continue;
            FAIL_CHECK(name << " of " << x[i] << " and " << y[i] << ": " << results[i] << ", not " << expected);
            break;
        }
    }
}

}  // namespace

TEST_CASE("lanes compute as C++ at special values", "[lanes]")
{
    const double special[] = {0,          -0.0,         1,      -1,       0.5,       -0.5,     1.5,       -1.5,
                              2.5,        -0.7,         -0.3,   2,        -2,        3,        0x1p31,    -0x1p31,
                              0x1p32,     0x1p52 + 0.5, 0x1p53, -0x1p53,  10,        0.1,      0x1p-1074, 0x1p-1022,
                              -0x1p-1074, 1e308,        -1e308, infinity, -infinity, no_number};
    std::vector<double> x, y;
    for (const double a : special)
        for (const double b : special) x.push_back(a), y.push_back(b);
    check(x, y);
}

TEST_CASE("lanes compute as C++ at random numbers", "[lanes][random]")
{
    std::mt19937_64 engine(5);
    std::vector<double> x(static_cast<std::size_t>(amount("MATH_VALUES", 10000))), y(x.size());
    std::uniform_real_distribution<double> mild(-20, 20);
    for (std::size_t i = 0; i < x.size(); ++i)
        for (double* value : {&x[i], &y[i]}) *value = i % 2 == 0 ? mild(engine) : std::bit_cast<double>(engine());
    check(x, y);
}
