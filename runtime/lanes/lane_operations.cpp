// The operations of lane programs. t, a, b and c are the slots of an instruction, k is its number.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "runtime/elementary.h"
#include "runtime/items.h"
#include "runtime/lanes/lane_tile.h"

namespace rapid {
namespace {

constexpr double most_float = std::numeric_limits<float>::max();

using Tile = LaneTile;
using Now = LaneInstruction;

// t = f(a), and f(a, b), by packs; of comparisons the flags.
template <class F>
bool of_one(Tile& tile, const Now& now)
{
    const Doubles* const a = tile.slot(now.a);
    tile.fill(now.to, [&](std::size_t k) { return F()(a[k]); });
    return true;
}
template <class F>
bool of_two(Tile& tile, const Now& now)
{
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b);
    tile.fill(now.to, [&](std::size_t k) { return std::bit_cast<Doubles>(F()(a[k], b[k])); });
    return true;
}

// Of functions of one number, by lanes.
template <class F>
struct ByLane {
    Doubles operator()(const Doubles& a) const
    {
        Doubles value;
        for (std::uint32_t l = 0; l < lanes; ++l) value[l] = F()(a[l]);
        return value;
    }
};
struct Floor {
    double operator()(double a) const { return std::floor(a); }
};
struct Ceiling {
    double operator()(double a) const { return std::ceil(a); }
};
struct Modulo {  // as Lua's
    Doubles operator()(const Doubles& a, const Doubles& b) const { return a - ByLane<Floor>()(a / b) * b; }
};
struct SquareRoot {
    Doubles operator()(const Doubles& a) const { return sqrt(a); }
};
struct Absolute {
    Doubles operator()(const Doubles& a) const { return magnitude(a); }
};
struct Sine {
    Doubles operator()(const Doubles& a) const { return sine(a); }
};
struct Cosine {
    Doubles operator()(const Doubles& a) const { return cosine(a); }
};
struct Exponential {
    Doubles operator()(const Doubles& a) const { return exponential(a); }
};
struct Round {  // to a float
    Doubles operator()(const Doubles& a) const { return widen(narrow(a)); }
};
struct And {
    Flags operator()(const Doubles& a, const Doubles& b) const { return as_flags(a) & as_flags(b); }
};
struct AndNot {  // a without b
    Flags operator()(const Doubles& a, const Doubles& b) const { return as_flags(a) & ~as_flags(b); }
};
struct Or {
    Flags operator()(const Doubles& a, const Doubles& b) const { return as_flags(a) | as_flags(b); }
};

// t = a ? b : c
bool choose(Tile& tile, const Now& now)
{
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b), *const c = tile.slot(now.c);
    tile.fill(now.to, [&](std::size_t k) { return as_flags(a[k]) != 0 ? b[k] : c[k]; });
    return true;
}

// The least or the largest. Where the flag c is set it fails of numbers of which Lua's result depends on their order:
// one is no number, or they are 0 of both signs.
template <class F>
bool extreme(Tile& tile, const Now& now)
{
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b), *const c = tile.slot(now.c);
    if (tile.any_of([&](std::size_t k) {
            return as_flags(c[k]) & ~((a[k] < b[k]) | (a[k] > b[k]) | (as_flags(a[k]) == as_flags(b[k])));
        }))
        return false;
    tile.fill(now.to, [&](std::size_t k) { return F()(a[k], b[k]); });
    return true;
}
struct Least {
    Doubles operator()(const Doubles& a, const Doubles& b) const { return least(a, b); }
};
struct Most {
    Doubles operator()(const Doubles& a, const Doubles& b) const { return most(a, b); }
};

// t = function k of the C library, of a, and of a and b
bool call1(Tile& tile, const Now& now)
{
    const double* const a = tile.numbers(now.a);
    std::transform(a, a + Tile::points, tile.numbers(now.to), tile.program.functions1[now.number]);
    return true;
}
bool call2(Tile& tile, const Now& now)
{
    const double *const a = tile.numbers(now.a), *const b = tile.numbers(now.b);
    std::transform(a, a + Tile::points, b, tile.numbers(now.to), tile.program.functions2[now.number]);
    return true;
}

// The key of the numbers of a frame.
RandomKey key_in_frame(RandomKey key, double frame)
{
    const auto mixed = uniform4(key, std::bit_cast<std::uint64_t>(frame), ~std::uint64_t{0});
    key.value ^= static_cast<std::uint64_t>(mixed[0] * 0x1p32) << 32 | static_cast<std::uint64_t>(mixed[1] * 0x1p32);
    return key;
}

// t = kernel_random() of the use a and the frame b; c: whether all points share these
bool random(Tile& tile, const Now& now)
{
    const LaneChunk& chunk = tile.chunk;
    const double *const use = tile.numbers(now.a), *const frame = tile.numbers(now.b);
    double* const into = tile.numbers(now.to);
    std::array<std::uint64_t, Tile::points> ids;
    const char* const from = static_cast<const char*>(chunk.ids.data) + tile.first * chunk.ids.stride;
    for (std::size_t i = 0; i < tile.size; ++i)
        ids[i] = *reinterpret_cast<const std::uint64_t*>(from + i * chunk.ids.stride);
    if (now.c) {
        const RandomKey key = frame[0] != 0 ? key_in_frame(chunk.random, frame[0]) : chunk.random;
        uniform53(key, {ids.data(), tile.size}, std::bit_cast<std::uint64_t>(use[0] + 0.0), {into, tile.size});
    } else {
        for (std::size_t i = 0; i < tile.size; ++i) into[i] = kernel_random(chunk.random, ids[i], use[i], frame[i]);
    }
    std::fill(into + tile.size, into + Tile::points, 0.0);
    return true;
}

// With the numbers of elements of T that most columns have from point to point known when it is compiled.
template <class Loop>
void with_step(std::size_t step, const Loop& loop)
{
    if (step == 1)
        loop(std::integral_constant<std::size_t, 1>());
    else if (step == 3)
        loop(std::integral_constant<std::size_t, 3>());
    else
        loop(step);
}

// t = component c of column k
template <class T>
bool load(Tile& tile, const Now& now)
{
    const LaneChunk::Memory& memory = tile.chunk.columns[now.number];
    const T* const from =
        reinterpret_cast<const T*>(static_cast<const char*>(memory.data) + tile.first * memory.stride) + now.c;
    double* const into = tile.numbers(now.to);
    const std::size_t size = memory.stride == 0 ? Tile::points : tile.size;
    with_step(memory.stride / sizeof(T), [&](auto step) {
        if (size == Tile::points)
            for (std::size_t i = 0; i < Tile::points; ++i) into[i] = static_cast<double>(from[i * step]);
        else
            for (std::size_t i = 0; i < Tile::points; ++i)
                into[i] = i < size ? static_cast<double>(from[i * step]) : 0.0;
    });
    return true;
}

// Component c of column k = a
template <class T>
bool store(Tile& tile, const Now& now)
{
    const LaneChunk::Memory& memory = tile.chunk.columns[now.number];
    T* const into = reinterpret_cast<T*>(static_cast<char*>(memory.data) + tile.first * memory.stride) + now.c;
    const double* const a = tile.numbers(now.a);
    with_step(memory.stride / sizeof(T), [&](auto step) {
        if (tile.visits_all())
            for (std::size_t i = 0; i < Tile::points; ++i) into[i * step] = static_cast<T>(a[i]);
        else
            for (std::size_t i = 0; i < tile.size; ++i)
                if (tile.visits(i)) into[i * step] = static_cast<T>(a[i]);
    });
    return true;
}

// t = flags of group k
bool load_flag(Tile& tile, const Now& now)
{
    const LaneChunk::Memory& memory = tile.chunk.groups[now.number];
    const auto* const from = static_cast<const std::uint8_t*>(memory.data) + tile.first * memory.stride;
    double* const into = tile.numbers(now.to);
    for (std::size_t i = 0; i < Tile::points; ++i)
        into[i] = std::bit_cast<double>(-std::int64_t{i < tile.size && from[i * memory.stride] != 0});
    return true;
}

// Bytes of 0 and 1 of the flags a.
void put_flags(const Tile& tile, const Now& now, std::uint8_t* into)
{
    into += tile.first;
    if (tile.visits_all())
        for (std::size_t i = 0; i < Tile::points; ++i) into[i] = tile.is_set(now.a, i);
    else
        for (std::size_t i = 0; i < tile.size; ++i)
            if (tile.visits(i)) into[i] = tile.is_set(now.a, i);
}
bool store_flag(Tile& tile, const Now& now)
{
    put_flags(tile, now, static_cast<std::uint8_t*>(tile.chunk.groups[now.number].data));
    return true;
}
bool store_result(Tile& tile, const Now& now)
{
    put_flags(tile, now, tile.chunk.result);
    return true;
}
bool kill(Tile& tile, const Now& now)
{
    for (std::size_t i = 0; i < tile.size; ++i)
        if (tile.visits(i) && tile.is_set(now.a, i)) tile.chunk.kill[tile.first + i] = 1;
    return true;
}

bool load_doubles(Tile& tile, const Now& now, const double* from)
{
    double* const into = tile.numbers(now.to);
    std::copy(from + tile.first, from + tile.first + tile.size, into);
    std::fill(into + tile.size, into + Tile::points, 0.0);
    return true;
}
bool load_time(Tile& tile, const Now& now) { return load_doubles(tile, now, tile.chunk.times); }
bool load_step(Tile& tile, const Now& now) { return load_doubles(tile, now, tile.chunk.steps); }

// t = the point's place in the set, from 1
bool index(Tile& tile, const Now& now)
{
    double* const into = tile.numbers(now.to);
    for (std::size_t i = 0; i < Tile::points; ++i) into[i] = tile.chunk.first + static_cast<double>(tile.first + i) + 1;
    return true;
}

// They fail where the flag a is set, and b is no number that a float can hold, or no integer of the type; Lua's are
// those within 2^53.
bool check_float(Tile& tile, const Now& now)
{
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b);
    return !tile.any_of([&](std::size_t k) { return as_flags(a[k]) & ~(magnitude(b[k]) <= most_float); });
}
bool check_integer(const Tile& tile, const Now& now, double least, double most)
{
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b);
    return !tile.any_of([&](std::size_t k) {
        return as_flags(a[k]) & ~((b[k] >= least) & (b[k] <= most) & (b[k] == ByLane<Floor>()(b[k])));
    });
}
bool check_int32(Tile& tile, const Now& now) { return check_integer(tile, now, -0x1p31, 0x1p31 - 1); }
bool check_int64(Tile& tile, const Now& now) { return check_integer(tile, now, -0x1p53, 0x1p53); }

// It fails where the flag a is set.
bool fail(Tile& tile, const Now& now)
{
    const Doubles* const a = tile.slot(now.a);
    return !tile.any_of([&](std::size_t k) { return as_flags(a[k]); });
}

constexpr std::pair<std::string_view, LaneOperation> operations[] = {
    {"Add", of_two<std::plus<>>},
    {"Subtract", of_two<std::minus<>>},
    {"Multiply", of_two<std::multiplies<>>},
    {"Divide", of_two<std::divides<>>},
    {"Modulo", of_two<Modulo>},
    {"Negate", of_one<std::negate<>>},
    {"SquareRoot", of_one<SquareRoot>},
    {"Absolute", of_one<Absolute>},
    {"Floor", of_one<ByLane<Floor>>},
    {"Ceiling", of_one<ByLane<Ceiling>>},
    {"Least", extreme<Least>},
    {"Most", extreme<Most>},
    {"Sine", of_one<Sine>},
    {"Cosine", of_one<Cosine>},
    {"Exponential", of_one<Exponential>},
    {"Call1", call1},
    {"Call2", call2},
    {"Less", of_two<std::less<>>},
    {"LessOrEqual", of_two<std::less_equal<>>},
    {"Equal", of_two<std::equal_to<>>},
    {"And", of_two<And>},
    {"AndNot", of_two<AndNot>},
    {"Or", of_two<Or>},
    {"Choose", choose},
    {"Round", of_one<Round>},
    {"Random", random},
    {"LoadFloat", load<float>},
    {"LoadDouble", load<double>},
    {"LoadInt32", load<std::int32_t>},
    {"LoadInt64", load<std::int64_t>},
    {"LoadFlag", load_flag},
    {"LoadTime", load_time},
    {"LoadStep", load_step},
    {"Index", index},
    {"CheckFloat", check_float},
    {"CheckInt32", check_int32},
    {"CheckInt64", check_int64},
    {"Fail", fail},
    {"StoreFloat", store<float>},
    {"StoreDouble", store<double>},
    {"StoreInt32", store<std::int32_t>},
    {"StoreInt64", store<std::int64_t>},
    {"StoreFlag", store_flag},
    {"Kill", kill},
    {"StoreResult", store_result},
};

}  // namespace

LaneOperation lane_operation(std::string_view name)
{
    const auto found = std::find_if(std::begin(operations), std::end(operations),
                                    [&](const auto& operation) { return operation.first == name; });
    return found == std::end(operations) ? nullptr : found->second;
}

double kernel_random(RandomKey key, std::uint64_t id, double use, double frame)
{
    // The points of a pass share the key: it takes as long as a number.
    thread_local struct {
        std::uint64_t random = 0;
        double frame = 0;
        RandomKey key;
    } last;
    if (frame != 0) {
        if (last.random != key.value || last.frame != frame) last = {key.value, frame, key_in_frame(key, frame)};
        key = last.key;
    }
    return uniform53(key, id, std::bit_cast<std::uint64_t>(use + 0.0));
}

}  // namespace rapid
