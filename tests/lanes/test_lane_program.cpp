// Tests handwritten lane programs: masks, failures, and points that are not visited.
#include <cmath>
#include <numeric>

#include "runtime/lanes/kernel_random.h"
#include "runtime/lanes/lane_program.h"
#include "tests/test.h"

using namespace rapid;

namespace {

// Returns the program x = 2 x if x > 1. Slot 6 is the constant after those of the chunk.
LaneProgram doubling()
{
    LaneProgram program;
    program.constants = {1, 2};
    const std::uint16_t one = 5, two = 6, x = 7, large = 8, twice = 9;
    program.code = {{lane_operation("LoadFloat"), x, 0, 0, 0, 0},
                    {lane_operation("Less"), large, one, x, 0, 0},
                    {lane_operation("Multiply"), twice, x, two, 0, 0},
                    {lane_operation("Choose"), x, large, twice, x, 0},
                    {lane_operation("CheckFloat"), 0, LaneProgram::visited, x, 0, 0},
                    {lane_operation("StoreFloat"), 0, x, 0, 0, 0}};
    program.slots = 10;
    return program;
}

using Failed = std::vector<std::pair<std::size_t, std::size_t>>;

Failed run(const LaneProgram& program, std::vector<float>& x, const std::vector<std::uint8_t>& members = {})
{
    const LaneChunk::Memory memory[] = {{x.data(), sizeof(float)}};
    LaneChunk chunk;
    chunk.size = x.size();
    chunk.columns = memory;
    chunk.members = members.empty() ? nullptr : members.data();
    Failed failed;
    LaneRunner().run(program, chunk, [&](std::size_t begin, std::size_t end) { failed.emplace_back(begin, end); });
    return failed;
}

}  // namespace

TEST_CASE("a program processes any number of points, and stores nothing after the last", "[lanes]")
{
    for (const std::size_t size : {1u, 7u, 127u, 128u, 129u, 1000u}) {
        std::vector<float> x(size);
        std::iota(x.begin(), x.end(), -2.0f);
        std::vector<float> expected = x;
        for (float& value : expected) value = value > 1 ? 2 * value : value;
        CHECK(run(doubling(), x).empty());
        CHECK(x == expected);
    }
}

TEST_CASE("points that are not visited stay as they are", "[lanes]")
{
    std::vector<float> x(300, 5.0f);
    std::vector<std::uint8_t> members(300);
    for (std::size_t i = 0; i < 140; i += 3) members[i] = 1;
    x[1] = std::numeric_limits<float>::quiet_NaN();
    CHECK(run(doubling(), x, members).empty());
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (i == 1)
            CHECK(std::isnan(x[i]));
        else
            CHECK(x[i] == (members[i] ? 10.0f : 5.0f));
    }
}

TEST_CASE("nothing of a tile with a missing value is stored", "[lanes]")
{
    std::vector<float> x(400, 5.0f);
    x[200] = std::numeric_limits<float>::max();  // twice this overflows
    CHECK(run(doubling(), x) == Failed{{128, 256}});
    for (std::size_t i = 0; i < x.size(); ++i)
        if (i != 200) CHECK(x[i] == (i >= 128 && i < 256 ? 5.0f : 10.0f));
}

TEST_CASE("a uniform value is computed again if its column or the chunk has other values", "[lanes]")
{
    // Computes into = column 0 times dt, which is in slot 3.
    LaneProgram program;
    program.steady = {{lane_operation("LoadFloat"), 5, 0, 0, 0, 0}, {lane_operation("Multiply"), 6, 5, 3, 0, 0}};
    program.steady_column = 0;
    program.code = {{lane_operation("StoreFloat"), 0, 6, 0, 0, 1}};
    program.slots = 7;
    std::vector<float> from(900, 3.0f), into(900);
    from[300] = 4.0f;                                         // inside a tile
    std::fill(from.begin() + 512, from.begin() + 640, 5.0f);  // a whole tile
    std::iota(from.end() - 10, from.end(), 7.0f);             // in the last tile, which is short
    LaneRunner runner;
    for (const double dt : {2.0, 3.0, 0.5}) {
        const LaneChunk::Memory memory[] = {{from.data(), sizeof(float)}, {into.data(), sizeof(float)}};
        LaneChunk chunk;
        chunk.size = from.size();
        chunk.dt = dt;
        chunk.columns = memory;
        runner.run(program, chunk, [](std::size_t, std::size_t) { FAIL(); });
        for (std::size_t i = 0; i < from.size(); ++i) CHECK(into[i] == from[i] * static_cast<float>(dt));
    }
}

TEST_CASE("random numbers of lanes are those of a kernel, one by one", "[lanes]")
{
    std::vector<std::int64_t> ids(300);
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i * i * 1000003);
    for (const bool is_shared : {true, false})
        for (const double frame : {0.0, 12.0}) {
            LaneProgram program;
            program.constants = {4, frame};
            const std::uint16_t use = 5, of_frame = 6, drawn = 7;
            program.code = {{lane_operation("Random"), drawn, use, of_frame, is_shared, 0},
                            {lane_operation("StoreDoubleVector"), 0, drawn, use, drawn, 0}};
            program.slots = 8;
            std::vector<double> numbers(3 * ids.size());
            const LaneChunk::Memory memory[] = {{numbers.data(), 3 * sizeof(double)}};
            LaneChunk chunk;
            chunk.size = ids.size();
            chunk.columns = memory;
            chunk.ids = {ids.data(), sizeof(std::int64_t)};
            chunk.random = RandomKey(3, "k");
            LaneRunner().run(program, chunk, [](std::size_t, std::size_t) { FAIL(); });
            for (std::size_t i = 0; i < ids.size(); ++i) {
                const double number = kernel_random(chunk.random, static_cast<std::uint64_t>(ids[i]), 4, frame);
                CHECK(numbers[3 * i] == number);
                CHECK(numbers[3 * i + 1] == 4);
                CHECK(numbers[3 * i + 2] == number);
            }
        }
}

// Copies vectors from one column to another with permuted components.
template <class T>
static void check_vectors(const char* load, const char* store)
{
    for (const std::size_t size : {1u, 127u, 128u, 129u, 400u}) {
        for (const bool with_members : {false, true}) {
            std::vector<T> from(3 * size), into(3 * size, T(-1));
            for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<T>(i) + T(0.5);
            std::vector<std::uint8_t> members(size, 1);
            for (std::size_t i = 0; with_members && i < size; i += 2) members[i] = 0;
            const LaneChunk::Memory memory[] = {{from.data(), 3 * sizeof(T)}, {into.data(), 3 * sizeof(T)}};
            LaneProgram program;
            program.code = {{lane_operation(load), 5, 0, 0, 0, 0},
                            {lane_operation(load), 6, 0, 0, 1, 0},
                            {lane_operation(load), 7, 0, 0, 2, 0},
                            {lane_operation(store), 0, 7, 5, 6, 1}};
            program.slots = 8;
            LaneChunk chunk;
            chunk.size = size;
            chunk.columns = memory;
            if (with_members) chunk.members = members.data();
            LaneRunner().run(program, chunk, [](std::size_t, std::size_t) { FAIL(); });
            for (std::size_t i = 0; i < size; ++i)
                for (std::size_t n = 0; n < 3; ++n) {
                    INFO(size << " points, " << i << ", " << n);
                    CHECK(into[3 * i + n] == (members[i] ? from[3 * i + (n + 2) % 3] : T(-1)));
                }
        }
    }
}

TEST_CASE("components of vectors are taken apart and put together", "[lanes]")
{
    check_vectors<float>("LoadFloat", "StoreFloatVector");
    check_vectors<double>("LoadDouble", "StoreDoubleVector");
}

TEST_CASE("two operations in one round twice, as one after the other", "[lanes]")
{
    using Two = double (*)(double, double);
    const std::pair<std::string, Two> of_two[] = {{"Add", [](double a, double b) { return a + b; }},
                                                  {"Subtract", [](double a, double b) { return a - b; }},
                                                  {"SubtractFrom", [](double a, double b) { return b - a; }},
                                                  {"Multiply", [](double a, double b) { return a * b; }}};
    const double a = 1 + 0x1p-30, b = 3 - 0x1p-31, c = -3;  // the product needs more digits than a double has
    for (const auto& [first, f] : of_two)
        for (const auto& [second, g] : of_two) {
            const LaneOperation operation = lane_operation(first + second);
            CHECK((operation != nullptr) == (first != "SubtractFrom"));
            if (!operation) continue;
            LaneProgram program;
            program.constants = {a, b, c};
            program.code = {{operation, 8, 5, 6, 7, 0}, {lane_operation("StoreDoubleVector"), 0, 8, 5, 6, 0}};
            program.slots = 9;
            std::vector<Vec3d> into(200);
            const LaneChunk::Memory memory[] = {{into.data(), sizeof(Vec3d)}};
            LaneChunk chunk;
            chunk.size = into.size();
            chunk.columns = memory;
            LaneRunner().run(program, chunk, [](std::size_t, std::size_t) { FAIL(); });
            INFO(first << second);
            for (const Vec3d& value : into) CHECK(value == Vec3d(g(f(a, b), c), a, b));
        }
}

TEST_CASE("a whole number has no -0", "[lanes]")
{
    LaneProgram program;
    program.constants = {-0.0, -3};
    program.code = {{lane_operation("Whole"), 7, 5, 0, 0, 0},
                    {lane_operation("Whole"), 8, 6, 0, 0, 0},
                    {lane_operation("Divide"), 9, 8, 7, 0, 0},
                    {lane_operation("StoreFloat"), 0, 9, 0, 0, 0}};
    program.slots = 10;
    std::vector<float> x(8);
    CHECK(run(program, x).empty());
    CHECK(x == std::vector<float>(8, -std::numeric_limits<float>::infinity()));
}

TEST_CASE("operations are found by their names", "[lanes]")
{
    CHECK(lane_operation("Add"));
    CHECK_FALSE(lane_operation("add"));
}
