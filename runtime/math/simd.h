// Packs of eight numbers with lane-by-lane arithmetic. Packs wider than a register are computed in parts, with
// bit-identical results on every processor.
//
// These are the compiler's vector types. Of Debian's libraries, Highway and xsimd size their vectors by the processor,
// but here a pack is part of the layout of records (contact packs) and of loops over whole points (24 coordinates). Vc
// has packs of a given size, but is no longer developed. None of them guarantees more about bits than IEEE arithmetic
// per lane.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>

#include "runtime/math/vec.h"

// The calling convention of wide vectors depends on the processor that a file is compiled for, and g++ warns about
// that. Functions that take or return packs are inlined, or stay within one file.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace rapid {

constexpr std::uint32_t lanes = 8;

// g++ aligns a vector type to its size. But alignof, which std::vector uses, is at most the width of a register: code
// for x86-64-v2 allocates at 16 bytes, and code for x86-64-v4 assumes 64. Therefore each struct of packs states its
// alignment (alignas), on which files of all processor levels agree. An `aligned` attribute here would not suffice: g++
// drops it if a pack is a template argument, as in Vectors<Doubles>.
typedef float Floats __attribute__((vector_size(4 * lanes)));
typedef double Doubles __attribute__((vector_size(8 * lanes)));
using Indices = std::array<std::uint32_t, lanes>;

[[gnu::always_inline]] inline Doubles widen(const Floats& x) { return __builtin_convertvector(x, Doubles); }
[[gnu::always_inline]] inline Floats narrow(const Doubles& x) { return __builtin_convertvector(x, Floats); }

// Comparisons return Flags for Doubles and FloatFlags for Floats: all bits of a lane are set, or none.
typedef std::int64_t Flags __attribute__((vector_size(8 * lanes)));
typedef std::int32_t FloatFlags __attribute__((vector_size(4 * lanes)));

typedef std::int8_t LaneBytes __attribute__((vector_size(lanes)));

// Returns one byte per lane: lane l is in the bits from 8 l on.
[[gnu::always_inline]] inline std::uint64_t bytes(const Flags& flags)
{
    return std::bit_cast<std::uint64_t>(__builtin_convertvector(flags, LaneBytes));
}
[[gnu::always_inline]] inline bool any(const Flags& flags) { return bytes(flags) != 0; }
// Returns one bit per lane: lane l is bit l.
[[gnu::always_inline]] inline std::uint32_t bits(const Flags& flags)
{
    return static_cast<std::uint32_t>((bytes(flags) & 0x8040201008040201) * 0x0101010101010101 >> 56);
}
// Returns the flags of the lanes whose bits are set.
[[gnu::always_inline]] inline FloatFlags float_flags(std::uint32_t bits)
{
    const FloatFlags lane_bit = {1, 2, 4, 8, 16, 32, 64, 128};
    return (lane_bit & static_cast<std::int32_t>(bits)) != 0;
}

// Load and store without alignment.
[[gnu::always_inline]] inline Floats load_pack(const float* from)
{
    Floats pack;
    std::memcpy(&pack, from, sizeof pack);
    return pack;
}
[[gnu::always_inline]] inline Doubles load_pack(const double* from)
{
    Doubles pack;
    std::memcpy(&pack, from, sizeof pack);
    return pack;
}
template <class Pack, class T>
[[gnu::always_inline]] inline void store_pack(const Pack& pack, T* to)
{
    static_assert(sizeof pack == lanes * sizeof *to);
    std::memcpy(to, &pack, sizeof pack);
}

// The doubles of one register. If a register is smaller than a pack, g++ would compare and select lane by lane in a
// pack.
#if defined(__AVX512F__)
typedef Doubles Register;
#elif defined(__AVX2__)
typedef double Register __attribute__((vector_size(32)));
#else
typedef double Register __attribute__((vector_size(16)));
#endif

// Applies f to each part of a pack.
template <class F>
[[gnu::always_inline]] inline Doubles by_registers(const Doubles& x, const F& f)
{
    struct Parts {
        Register of[sizeof(Doubles) / sizeof(Register)];
    };
    Parts parts = std::bit_cast<Parts>(x);
    for (Register& part : parts.of) part = f(part);
    return std::bit_cast<Doubles>(parts);
}

[[gnu::always_inline]] inline Doubles least(const Doubles& a, const Doubles& b) { return a < b ? a : b; }
[[gnu::always_inline]] inline Doubles most(const Doubles& a, const Doubles& b) { return a > b ? a : b; }
[[gnu::always_inline]] inline Doubles magnitude(const Doubles& x)
{
    return std::bit_cast<Doubles>(std::bit_cast<Flags>(x) & INT64_MAX);
}
[[gnu::always_inline]] inline Doubles sqrt(const Doubles& x)
{
    Doubles root;
    for (std::uint32_t l = 0; l < lanes; ++l) root[l] = std::sqrt(x[l]);
    return root;
}

// Eight vectors, by coordinate.
template <class Eight>
struct alignas(sizeof(Eight)) Vectors {
    using Scalar = std::remove_cvref_t<decltype(Eight()[0])>;
    Eight x, y, z;

    Vec3d operator[](std::uint32_t l) const { return Vec3d(x[l], y[l], z[l]); }
    void set(std::uint32_t l, const Vec3d& value)
    {
        const auto as = value.cast<Scalar>();
        x[l] = as.x(), y[l] = as.y(), z[l] = as.z();
    }
    Vectors& operator+=(const Vectors& b) { return x += b.x, y += b.y, z += b.z, *this; }
    Vectors& operator-=(const Vectors& b) { return x -= b.x, y -= b.y, z -= b.z, *this; }
    friend Vectors operator+(const Vectors& a, const Vectors& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Vectors operator-(const Vectors& a, const Vectors& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Vectors operator*(const Eight& s, const Vectors& a) { return {s * a.x, s * a.y, s * a.z}; }
    friend Vectors operator*(Scalar s, const Vectors& a) { return {s * a.x, s * a.y, s * a.z}; }
    [[gnu::always_inline]] friend Eight dot(const Vectors& a, const Vectors& b)
    {
        return a.x * b.x + a.y * b.y + a.z * b.z;
    }
};

[[gnu::always_inline]] inline Vectors<Doubles> widen(const Vectors<Floats>& a)
{
    return {widen(a.x), widen(a.y), widen(a.z)};
}
[[gnu::always_inline]] inline Vectors<Floats> narrow(const Vectors<Doubles>& a)
{
    return {narrow(a.x), narrow(a.y), narrow(a.z)};
}

namespace detail {

typedef double Two __attribute__((vector_size(16)));
typedef double Four __attribute__((vector_size(32)));

[[gnu::always_inline]] inline Doubles both(const Four& a, const Four& b)
{
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}

// The transpose of eight rows of four numbers, given in pairs.
struct alignas(sizeof(Doubles)) Columns {
    Doubles x, y, z, w;
};
[[gnu::always_inline]] inline Columns columns_of(const Doubles& rows01, const Doubles& rows23, const Doubles& rows45,
                                                 const Doubles& rows67)
{
    const Doubles xy0 = __builtin_shufflevector(rows01, rows23, 0, 4, 8, 12, 1, 5, 9, 13);
    const Doubles zw0 = __builtin_shufflevector(rows01, rows23, 2, 6, 10, 14, 3, 7, 11, 15);
    const Doubles xy4 = __builtin_shufflevector(rows45, rows67, 0, 4, 8, 12, 1, 5, 9, 13);
    const Doubles zw4 = __builtin_shufflevector(rows45, rows67, 2, 6, 10, 14, 3, 7, 11, 15);
    return {__builtin_shufflevector(xy0, xy4, 0, 1, 2, 3, 8, 9, 10, 11),
            __builtin_shufflevector(xy0, xy4, 4, 5, 6, 7, 12, 13, 14, 15),
            __builtin_shufflevector(zw0, zw4, 0, 1, 2, 3, 8, 9, 10, 11),
            __builtin_shufflevector(zw0, zw4, 4, 5, 6, 7, 12, 13, 14, 15)};
}

// The inverse transpose: the rows in pairs.
struct alignas(sizeof(Doubles)) Rows {
    Doubles of01, of23, of45, of67;
};
[[gnu::always_inline]] inline Rows rows_of(const Columns& c)
{
    const Doubles xy0 = __builtin_shufflevector(c.x, c.y, 0, 8, 1, 9, 2, 10, 3, 11);
    const Doubles zw0 = __builtin_shufflevector(c.z, c.w, 0, 8, 1, 9, 2, 10, 3, 11);
    const Doubles xy4 = __builtin_shufflevector(c.x, c.y, 4, 12, 5, 13, 6, 14, 7, 15);
    const Doubles zw4 = __builtin_shufflevector(c.z, c.w, 4, 12, 5, 13, 6, 14, 7, 15);
    return {__builtin_shufflevector(xy0, zw0, 0, 1, 8, 9, 2, 3, 10, 11),
            __builtin_shufflevector(xy0, zw0, 4, 5, 12, 13, 6, 7, 14, 15),
            __builtin_shufflevector(xy4, zw4, 0, 1, 8, 9, 2, 3, 10, 11),
            __builtin_shufflevector(xy4, zw4, 4, 5, 12, 13, 6, 7, 14, 15)};
}

[[gnu::always_inline]] inline Four first(const Doubles& rows)
{
    return __builtin_shufflevector(rows, rows, 0, 1, 2, 3);
}
[[gnu::always_inline]] inline Four second(const Doubles& rows)
{
    return __builtin_shufflevector(rows, rows, 4, 5, 6, 7);
}

// Stores the first `count` rows with store(lane, row).
template <class F>
[[gnu::always_inline]] inline void store_rows(const Columns& columns, std::uint32_t count, const F& store)
{
    const Rows rows = rows_of(columns);
    store(0, first(rows.of01));
    if (count == lanes) {  // the usual case
        store(1, second(rows.of01));
        store(2, first(rows.of23));
        store(3, second(rows.of23));
        store(4, first(rows.of45));
        store(5, second(rows.of45));
        store(6, first(rows.of67));
        store(7, second(rows.of67));
        return;
    }
    if (count > 1) store(1, second(rows.of01));
    if (count > 2) store(2, first(rows.of23));
    if (count > 3) store(3, second(rows.of23));
    if (count > 4) store(4, first(rows.of45));
    if (count > 5) store(5, second(rows.of45));
    if (count > 6) store(6, first(rows.of67));
}

template <class F>
[[gnu::always_inline]] inline Columns gathered(const F& row)
{
    return columns_of(both(row(0), row(1)), both(row(2), row(3)), both(row(4), row(5)), both(row(6), row(7)));
}

}  // namespace detail

[[gnu::always_inline]] inline Vectors<Doubles> gather(std::span<const Vec3d> from, const Indices& i)
{
    const auto c = detail::gathered([&](std::uint32_t l) __attribute__((always_inline)) {
        const double* x = from[i[l]].data();
        detail::Two xy;
        std::memcpy(&xy, x, sizeof xy);
        const detail::Two z = {x[2], 0};
        return __builtin_shufflevector(xy, z, 0, 1, 2, 3);
    });
    return {c.x, c.y, c.z};
}

// Writes the first `count` lanes.
[[gnu::always_inline]] inline void scatter(const Vectors<Doubles>& values, std::span<Vec3d> to, const Indices& i,
                                           std::uint32_t count)
{
    detail::store_rows(
        {values.x, values.y, values.z, values.z},
        count, [&](std::uint32_t l, const auto& row) __attribute__((always_inline)) {
            std::memcpy(to[i[l]].data(), &row, sizeof(Vec3d));
        });
}

}  // namespace rapid
