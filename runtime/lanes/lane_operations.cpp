// The operations of lane programs. t, a, b and c are the slots of an instruction, and k is its number.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <type_traits>
#include <utility>

#include "runtime/lanes/kernel_random.h"
#include "runtime/lanes/lane_tile.h"
#include "runtime/math/elementary.h"
#include "runtime/math/items.h"
#include "runtime/math/power.h"

namespace rapid {
namespace {

constexpr double max_float = std::numeric_limits<float>::max();

using Tile = LaneTile;
using Now = LaneInstruction;

// t = f(a), or f(a, b), pack by pack. Comparisons return flags.
template <class F>
bool unary(Tile& tile, const Now& now)
{
    const Doubles* const a = tile.slot(now.a);
    tile.fill(now.to, [&](std::size_t k) { return F()(a[k]); });
    return true;
}
template <class F>
bool binary(Tile& tile, const Now& now)
{
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b);
    tile.fill(now.to, [&](std::size_t k) { return std::bit_cast<Doubles>(F()(a[k], b[k])); });
    return true;
}

// t = g(f(a, b), c), or g(c, f(a, b)).
template <class F, class G>
bool ternary(Tile& tile, const Now& now)
{
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b), *const c = tile.slot(now.c);
    tile.fill(now.to, [&](std::size_t k) { return G()(F()(a[k], b[k]), c[k]); });
    return true;
}
struct SubtractFrom {
    Doubles operator()(const Doubles& a, const Doubles& b) const { return b - a; }
};

// Applies a function of one number to each lane.
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
struct Modulo {  // like Lua's %
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
struct Logarithm {
    Doubles operator()(const Doubles& a) const { return logarithm(a); }
};
struct Power {
    Doubles operator()(const Doubles& a, const Doubles& b) const { return power(a, b); }
};
struct Round {  // to a float
    Doubles operator()(const Doubles& a) const { return widen(narrow(a)); }
};
struct Whole {  // an integer has no -0
    Doubles operator()(const Doubles& a) const { return a + 0.0; }
};
struct And {
    Flags operator()(const Doubles& a, const Doubles& b) const { return as_flags(a) & as_flags(b); }
};
struct AndNot {  // a and not b
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

// math.min and math.max of two numbers, as lua/elementary.lua defines them: NaN if either is NaN, and zeros become +0.
template <class F>
struct Extreme {
    Doubles operator()(const Doubles& a, const Doubles& b) const
    {
        const Doubles sum = a + b;
        return ((a == a) & (b == b)) ? F()(a, b) + 0.0 : sum;
    }
};
struct Min {
    Doubles operator()(const Doubles& a, const Doubles& b) const { return least(a, b); }
};
struct Max {
    Doubles operator()(const Doubles& a, const Doubles& b) const { return most(a, b); }
};

// t = function k of a, or of a and b
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

// t = kernel_random() for the use a and the frame b. c: true if all points share both.
bool random(Tile& tile, const Now& now)
{
    const LaneChunk& chunk = tile.chunk;
    const double *const use = tile.numbers(now.a), *const frame = tile.numbers(now.b);
    double* const into = tile.numbers(now.to);
    const std::size_t step = chunk.ids.stride / sizeof(std::uint64_t);
    const std::uint64_t* ids = static_cast<const std::uint64_t*>(chunk.ids.data) + tile.first * step;
    std::array<std::uint64_t, Tile::points> same;
    if (step == 0) {
        same.fill(*ids);
        ids = same.data();
    }
    if (now.c) {
        const RandomKey key = frame[0] != 0 ? key_in_frame(chunk.random, frame[0]) : chunk.random;
        uniform53(key, {ids, tile.size}, std::bit_cast<std::uint64_t>(use[0] + 0.0), {into, tile.size});
    } else {
        for (std::size_t i = 0; i < tile.size; ++i) into[i] = kernel_random(chunk.random, ids[i], use[i], frame[i]);
    }
    std::fill(into + tile.size, into + Tile::points, 0.0);
    return true;
}

template <class T>
using Pack = std::conditional_t<std::is_same_v<T, double>, Doubles, Floats>;

[[gnu::always_inline]] inline Doubles to_doubles(const Doubles& x) { return x; }
[[gnu::always_inline]] inline Doubles to_doubles(const Floats& x) { return widen(x); }
template <class T>
[[gnu::always_inline]] inline Pack<T> from_doubles(const Doubles& x)
{
    if constexpr (std::is_same_v<T, double>)
        return x;
    else
        return narrow(x);
}

// Returns component c of eight vectors that are stored contiguously in three packs.
template <int c, class P>
[[gnu::always_inline]] inline P component(const P& p, const P& q, const P& r)
{
    if constexpr (c == 0)
        return __builtin_shufflevector(__builtin_shufflevector(p, q, 0, 3, 6, 9, 12, 15, 0, 0), r, 0, 1, 2, 3, 4, 5, 10,
                                       13);
    else if constexpr (c == 1)
        return __builtin_shufflevector(__builtin_shufflevector(p, q, 1, 4, 7, 10, 13, 0, 0, 0), r, 0, 1, 2, 3, 4, 8, 11,
                                       14);
    else
        return __builtin_shufflevector(__builtin_shufflevector(p, q, 2, 5, 8, 11, 14, 0, 0, 0), r, 0, 1, 2, 3, 4, 9, 12,
                                       15);
}

template <int c, class T>
void load_component(const T* from, Doubles* into)
{
    for (std::size_t k = 0; k < Tile::packs; ++k, from += 3 * lanes)
        into[k] = to_doubles(component<c>(load_pack(from), load_pack(from + lanes), load_pack(from + 2 * lanes)));
}

// t = component c of column k
template <class T>
bool load(Tile& tile, const Now& now)
{
    const LaneChunk::Memory& memory = tile.chunk.columns[now.number];
    const T* const from =
        reinterpret_cast<const T*>(static_cast<const char*>(memory.data) + tile.first * memory.stride);
    const std::size_t step = memory.stride / sizeof(T);
    double* const into = tile.numbers(now.to);
    if constexpr (std::is_floating_point_v<T>) {
        if (step == 3 && tile.size == Tile::points) {
            constexpr decltype(&load_component<0, T>) of_component[] = {load_component<0, T>, load_component<1, T>,
                                                                        load_component<2, T>};
            of_component[now.c](from, tile.slot(now.to));
            return true;
        }
    }
    if (step == 1 && tile.size == Tile::points)
        for (std::size_t i = 0; i < Tile::points; ++i) into[i] = static_cast<double>(from[i]);
    else
        for (std::size_t i = 0; i < Tile::points; ++i)
            into[i] = i < tile.size || step == 0 ? static_cast<double>(from[i * step + now.c]) : 0.0;
    return true;
}

// Component c of column k = a
template <class T>
bool store(Tile& tile, const Now& now)
{
    const LaneChunk::Memory& memory = tile.chunk.columns[now.number];
    T* const into = reinterpret_cast<T*>(static_cast<char*>(memory.data) + tile.first * memory.stride);
    const std::size_t step = memory.stride / sizeof(T);
    const double* const a = tile.numbers(now.a);
    if (step == 1 && tile.visits_all())
        for (std::size_t i = 0; i < Tile::points; ++i) into[i] = static_cast<T>(a[i]);
    else
        for (std::size_t i = 0; i < tile.size; ++i)
            if (tile.visits(i)) into[i * step + now.c] = static_cast<T>(a[i]);
    return true;
}

// The vectors of column k = (a, b, c)
template <class T>
bool store_vector(Tile& tile, const Now& now)
{
    T* into = reinterpret_cast<T*>(static_cast<char*>(tile.chunk.columns[now.number].data)) + 3 * tile.first;
    if (!tile.visits_all()) {
        const double* const from[] = {tile.numbers(now.a), tile.numbers(now.b), tile.numbers(now.c)};
        for (std::size_t i = 0; i < tile.size; ++i)
            if (tile.visits(i))
                for (std::size_t n = 0; n < 3; ++n) into[3 * i + n] = static_cast<T>(from[n][i]);
        return true;
    }
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b), *const c = tile.slot(now.c);
    for (std::size_t k = 0; k < Tile::packs; ++k, into += 3 * lanes) {
        const Pack<T> x = from_doubles<T>(a[k]), y = from_doubles<T>(b[k]), z = from_doubles<T>(c[k]);
        const Pack<T> xy0 = __builtin_shufflevector(x, y, 0, 8, 0, 1, 9, 0, 2, 10),
                      xy1 = __builtin_shufflevector(x, y, 0, 3, 11, 0, 4, 12, 0, 5),
                      xy2 = __builtin_shufflevector(x, y, 13, 0, 6, 14, 0, 7, 15, 0);
        store_pack(Pack<T>(__builtin_shufflevector(xy0, z, 0, 1, 8, 3, 4, 9, 6, 7)), into);
        store_pack(Pack<T>(__builtin_shufflevector(xy1, z, 10, 1, 2, 11, 4, 5, 12, 7)), into + lanes);
        store_pack(Pack<T>(__builtin_shufflevector(xy2, z, 0, 13, 2, 3, 14, 5, 6, 15)), into + 2 * lanes);
    }
    return true;
}

// t = flags of group k
bool load_flag(Tile& tile, const Now& now)
{
    const LaneChunk::Memory& memory = tile.chunk.groups[now.number];
    const auto* const from = static_cast<const std::uint8_t*>(memory.data) + tile.first * memory.stride;
    if (memory.stride == 1 && tile.size == Tile::points) {
        tile.fill(now.to, [&](std::size_t k) {
            LaneBytes members;
            std::memcpy(&members, from + k * lanes, sizeof members);
            return as_doubles(__builtin_convertvector(members != 0, Flags));
        });
        return true;
    }
    double* const into = tile.numbers(now.to);
    for (std::size_t i = 0; i < Tile::points; ++i)
        into[i] = std::bit_cast<double>(-std::int64_t{i < tile.size && from[i * memory.stride] != 0});
    return true;
}

// Writes the flags a as bytes 0 and 1.
void put_flags(const Tile& tile, const Now& now, std::uint8_t* into)
{
    into += tile.first;
    if (!tile.visits_all()) {
        for (std::size_t i = 0; i < tile.size; ++i)
            if (tile.visits(i)) into[i] = tile.is_set(now.a, i);
        return;
    }
    const Doubles* const a = tile.slot(now.a);
    for (std::size_t k = 0; k < Tile::packs; ++k) {
        const std::uint64_t flags = bytes(as_flags(a[k])) & 0x0101010101010101;
        std::memcpy(into + k * lanes, &flags, sizeof flags);
    }
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

// t = the point's index in the set, from 1
bool index(Tile& tile, const Now& now)
{
    double* const into = tile.numbers(now.to);
    for (std::size_t i = 0; i < Tile::points; ++i) into[i] = tile.chunk.first + static_cast<double>(tile.first + i) + 1;
    return true;
}

// Fail if flag a is set and b is not in the range of a float, or is not an integer of the type; Lua's integers are
// those within 2^53.
bool check_float(Tile& tile, const Now& now)
{
    const Doubles *const a = tile.slot(now.a), *const b = tile.slot(now.b);
    return !tile.any_of([&](std::size_t k) { return as_flags(a[k]) & ~(magnitude(b[k]) <= max_float); });
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

// Fails if flag a is set.
bool fail(Tile& tile, const Now& now)
{
    const Doubles* const a = tile.slot(now.a);
    return !tile.any_of([&](std::size_t k) { return as_flags(a[k]); });
}

constexpr std::pair<std::string_view, LaneOperation> operations[] = {
    {"Add", binary<std::plus<>>},
    {"Subtract", binary<std::minus<>>},
    {"Multiply", binary<std::multiplies<>>},
    {"Divide", binary<std::divides<>>},
    {"AddAdd", ternary<std::plus<>, std::plus<>>},
    {"AddSubtract", ternary<std::plus<>, std::minus<>>},
    {"AddSubtractFrom", ternary<std::plus<>, SubtractFrom>},
    {"AddMultiply", ternary<std::plus<>, std::multiplies<>>},
    {"SubtractAdd", ternary<std::minus<>, std::plus<>>},
    {"SubtractSubtract", ternary<std::minus<>, std::minus<>>},
    {"SubtractSubtractFrom", ternary<std::minus<>, SubtractFrom>},
    {"SubtractMultiply", ternary<std::minus<>, std::multiplies<>>},
    {"MultiplyAdd", ternary<std::multiplies<>, std::plus<>>},
    {"MultiplySubtract", ternary<std::multiplies<>, std::minus<>>},
    {"MultiplySubtractFrom", ternary<std::multiplies<>, SubtractFrom>},
    {"MultiplyMultiply", ternary<std::multiplies<>, std::multiplies<>>},
    {"Modulo", binary<Modulo>},
    {"Negate", unary<std::negate<>>},
    {"SquareRoot", unary<SquareRoot>},
    {"Absolute", unary<Absolute>},
    {"Floor", unary<ByLane<Floor>>},
    {"Ceiling", unary<ByLane<Ceiling>>},
    {"Least", binary<Extreme<Min>>},
    {"Most", binary<Extreme<Max>>},
    {"Sine", unary<Sine>},
    {"Cosine", unary<Cosine>},
    {"Exponential", unary<Exponential>},
    {"Logarithm", unary<Logarithm>},
    {"Power", binary<Power>},
    {"Call1", call1},
    {"Call2", call2},
    {"Less", binary<std::less<>>},
    {"LessOrEqual", binary<std::less_equal<>>},
    {"Equal", binary<std::equal_to<>>},
    {"And", binary<And>},
    {"AndNot", binary<AndNot>},
    {"Or", binary<Or>},
    {"Choose", choose},
    {"Round", unary<Round>},
    {"Whole", unary<Whole>},
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
    {"StoreFloatVector", store_vector<float>},
    {"StoreDoubleVector", store_vector<double>},
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

}  // namespace rapid
