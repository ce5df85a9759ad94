#include "runtime/math/noise.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // vectors are passed only within this file

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

// The corners of a cell are a long piece of code without branches. In g++'s default order a third of it spills
// registers.
#pragma GCC optimize("schedule-insns", "sched-pressure")

namespace rapid {
namespace {

// The same code computes one point, or eight in SIMD vectors (types of g++ and clang; a machine without vectors of that
// length uses several short ones).
struct One {
    using Real = double;
    using Bits = std::uint32_t;
    using Words = std::uint64_t;

    static Bits low(Words words) { return static_cast<Bits>(words); }
    static Words wide(Bits bits) { return bits; }
};

struct Eight {
    static constexpr std::size_t size = 8;
    typedef double Real __attribute__((vector_size(64)));
    typedef std::uint32_t Bits __attribute__((vector_size(32)));
    typedef std::uint64_t Words __attribute__((vector_size(64)));

    static Bits low(const Words& words) { return __builtin_convertvector(words, Bits); }
    static Words wide(const Bits& bits) { return __builtin_convertvector(bits, Words); }
};

// Wellons' lowbias32: each bit of x changes each bit of the result in nearly half of all cases.
template <class Bits>
inline Bits mixed(Bits x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

// One axis of a cell: the lattice index below x, the fraction f of x above it, and the weight of the corner above,
// s = f³ (f (6f - 15) + 10), whose first and second derivatives vanish at both corners.
template <class Lane>
struct Axis {
    typename Lane::Bits corner;
    typename Lane::Real f, s, slope;

    Axis() = default;
    explicit Axis(const typename Lane::Real& x)
    {
        // Adding 1.5 · 2⁵² leaves the nearest integer in the low bits; without a conversion, no x is out of range.
        constexpr double whole = 0x1.8p52;
        typename Lane::Real below = (x + whole) - whole;
        below = below > x ? below - 1.0 : below;
        corner = Lane::low(std::bit_cast<typename Lane::Words>(below + whole));
        f = x - below;
        // f is 1 just below a corner, if the fraction rounds to it. Numbers beyond 2⁵¹ have no fractions. NaN stays
        // NaN.
        f = ((f >= 0.0) & (f <= 1.0)) ? f : f - f;
        s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
        slope = f * f * (f * (f * 30.0 - 60.0) + 30.0);
    }
};

// Returns the gradient of a lattice corner in space and time. Three of its four components are 1 or -1 and one is 0,
// chosen by six bits. (At a fixed time these are the midpoints of a cube's edges, as in Perlin's noise, and its
// corners.)
template <int axes>
inline void gradient_of(const Eight::Words& bits, Eight::Real (&g)[4])
{
#if defined(__AVX512F__) && !defined(__clang__)
    // Looks up the values in registers, by the two bits that choose the 0 and the bit of the axis.
    constexpr Eight::Real minus = {-1, -1, -1, -1, 1, 1, 1, 1};
    const auto with_0_at = [&](int at) {
        Eight::Real values = minus;
        values[at] = values[at + 4] = 0;
        return values;
    };
    g[0] = __builtin_shuffle(with_0_at(0), bits);
    const Eight::Real low = {-1, 0, -1, -1, -1, 0, -1, -1}, high = {1, 0, 1, 1, 1, 0, 1, 1};
    g[1] = __builtin_shuffle(low, high, bits);
    for (int axis = 2; axis < axes; ++axis) {
        const Eight::Words moved = bits >> axis;
        g[axis] = __builtin_shuffle(with_0_at(axis), ((moved ^ bits) & 4) ^ bits);
    }
#else
    constexpr std::uint64_t one = 0x3ff0000000000000, sign = 0x8000000000000000;  // of a double
    for (std::uint64_t axis = 0; axis < axes; ++axis) {
        const Eight::Words value = ((bits << (61 - axis)) & sign) ^ (sign | one);
        g[axis] = std::bit_cast<Eight::Real>((bits & 3) == axis ? value ^ value : value);
    }
#endif
}

// Returns the same for one point, from a table.
template <int axes>
inline void gradient_of(One::Words bits, double (&g)[4])
{
    static constexpr auto table = [] {
        std::array<std::array<double, 4>, 64> all{};
        for (std::uint32_t k = 0; k < 64; ++k)
            for (std::uint32_t axis = 0; axis < 4; ++axis)
                all[k][axis] = (k & 3) == axis ? 0 : (k >> (2 + axis) & 1) != 0 ? 1 : -1;
        return all;
    }();
    std::copy_n(table[bits & 63].begin(), axes, g);
}

constexpr double roughness = 0.5;  // amplitude of an octave relative to the one before

struct Octave {
    double amount, fineness, shift;
    std::uint32_t seed;
    Axis<One> time;
};

// Adds the value and the gradient of an octave at x.
inline void add_octave(const double (&x)[3], const Octave& octave, double& value, double (&gradient)[3])
{
    const Axis<One>& time = octave.time;
    const Axis<One> axes[3] = {Axis<One>(x[0]), Axis<One>(x[1]), Axis<One>(x[2])};
    for (std::uint32_t dw = 0; dw < (time.f == 0 ? 1u : 2u); ++dw) {
        const double weight_w = octave.amount * (dw ? time.s : 1 - time.s);
        const std::uint32_t hash_w = mixed(mixed(octave.seed) + time.corner + dw);
        for (std::uint32_t corner = 0; corner < 8; ++corner) {
            const std::uint32_t d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
            std::uint32_t hash = hash_w;
            for (int axis = 2; axis >= 0; --axis) hash = mixed(axes[axis].corner + hash + d[axis]);
            double weights[3], g[4];
            for (int axis = 0; axis < 3; ++axis) weights[axis] = d[axis] ? axes[axis].s : 1.0 - axes[axis].s;
            gradient_of<4>(One::wide(hash), g);
            double along = g[3] * (time.f - dw);
            for (int axis = 0; axis < 3; ++axis) along += g[axis] * (axes[axis].f - d[axis]);
            const double weight = weight_w * weights[0] * weights[1] * weights[2];
            value += weight * along;
            for (int axis = 0; axis < 3; ++axis) {
                const double slope = d[axis] ? axes[axis].slope : -axes[axis].slope;
                const double others = weights[(axis + 1) % 3] * weights[(axis + 2) % 3];
                gradient[axis] += weight_w * slope * others * along + weight * g[axis];
            }
        }
    }
}

// Computes the curl at x of an octave of three noises on one lattice, summed over the corners of the cell: the curl of
// the corner's gradients times its weight, plus the gradient of the weight crossed with the corner's values.
template <class Lane, bool moves>
inline void curl_of_octave(const typename Lane::Real (&x)[3], const Octave& octave, typename Lane::Real (&curl)[3])
{
    const Axis<One>& time = octave.time;
    using Real = typename Lane::Real;
    using Bits = typename Lane::Bits;
    const Axis<Lane> axes[3] = {Axis<Lane>(x[0]), Axis<Lane>(x[1]), Axis<Lane>(x[2])};
    Real to[2][3];  // offsets from the lower and the upper corner
    for (int axis = 0; axis < 3; ++axis) to[0][axis] = axes[axis].f, to[1][axis] = axes[axis].f - 1.0;

    for (std::uint32_t dw = 0; dw < (moves ? 2u : 1u); ++dw) {
        const double weight_w = dw ? time.s : 1 - time.s;
        const std::uint32_t hash_w = mixed(mixed(octave.seed) + time.corner + dw);
#pragma GCC unroll 2
        for (std::uint32_t dz = 0; dz < 2; ++dz) {
            const Bits hash_z = mixed(axes[2].corner + (hash_w + dz));
            Real weight_z = dz ? axes[2].s : 1.0 - axes[2].s;
            Real slope_z = dz ? axes[2].slope : -axes[2].slope;
            if constexpr (moves) weight_z *= weight_w, slope_z *= weight_w;
#pragma GCC unroll 2
            for (std::uint32_t dy = 0; dy < 2; ++dy) {
                const Bits hash_y = mixed(axes[1].corner + (hash_z + dy));
                const Real weight_y = dy ? axes[1].s : 1.0 - axes[1].s;
                const Real slope_y = dy ? axes[1].slope : -axes[1].slope;
                const Real weight_yz = weight_y * weight_z;
                const Real slope_yz = slope_y * weight_z, slope_zy = weight_y * slope_z;
#pragma GCC unroll 2
                for (std::uint32_t dx = 0; dx < 2; ++dx) {
                    typename Lane::Words bits = Lane::wide(mixed(axes[0].corner + (hash_y + dx)));
                    const Real weight_x = dx ? axes[0].s : 1.0 - axes[0].s;
                    const Real slope_x = dx ? axes[0].slope : -axes[0].slope;
                    const Real weight = weight_x * weight_yz;
                    const Real slopes[3] = {slope_x * weight_yz, weight_x * slope_yz, weight_x * slope_zy};
                    Real g[3][4], along[3];
                    for (int k = 0; k < 3; ++k, bits >>= 6) {
                        gradient_of<moves ? 4 : 3>(bits, g[k]);
                        along[k] = g[k][0] * to[dx][0] + g[k][1] * to[dy][1] + g[k][2] * to[dz][2];
                        if constexpr (moves) along[k] += g[k][3] * (time.f - dw);
                    }
                    for (int k = 0; k < 3; ++k) {
                        const int l = (k + 1) % 3, m = (k + 2) % 3;
                        curl[k] += weight * (g[m][l] - g[l][m]) + (slopes[l] * along[m] - slopes[m] * along[l]);
                    }
                }
            }
        }
    }
}

// The octaves of a field.
class Octaves {
public:
    explicit Octaves(const NoiseOptions& options) : size_(options.octaves)
    {
        double amount = 1, fineness = 1;
        for (int k = 0; k < size_; ++k) {
            // Without the shift all octaves would be 0 at the corners of the first one.
            const double shift = 0.618033988749895 * k;
            const std::uint32_t seed = options.seed + 0x9e3779b9u * static_cast<std::uint32_t>(k);
            all_[k] = {amount, fineness, shift, seed, Axis<One>(options.time * fineness)};
            amount *= roughness;
            fineness *= 2;
        }
    }

    const Octave* begin() const { return all_.data(); }
    const Octave* end() const { return all_.data() + size_; }

private:
    int size_;
    std::array<Octave, NoiseOptions::max_octaves> all_;
};

// Returns a position in the lattice of an octave.
template <class Lane>
inline void place_in(const Octave& octave, const typename Lane::Real (&P)[3], typename Lane::Real (&x)[3])
{
    for (int axis = 0; axis < 3; ++axis) x[axis] = P[axis] * octave.fineness + (axis + 1) * octave.shift;
}

// Returns 1 + r + r² + ..., n terms.
double geometric(double r, int n) { return (1 - std::pow(r, n)) / (1 - r); }

// Upper bound for any choice of gradients and any position in a cell: 1.5366 by hill climbing from 3,000 positions.
constexpr double largest_value = 1.54;
// Root mean square length of the curl of one octave at whole times, measured at 3 · 10⁶ positions.
constexpr double curl_length = 1.83;

double curl_scale(const NoiseOptions& options)
{
    return 1 / (curl_length * std::sqrt(geometric(roughness * roughness, options.octaves)));
}

// Computes the curl of the octaves' potentials. The potential of an octave weakens as it gets finer, so that its curl
// is `roughness` times that of the previous octave.
template <class Lane>
inline void curl_of(const typename Lane::Real (&P)[3], const Octaves& octaves, double scale,
                    typename Lane::Real (&curl)[3])
{
    for (int k = 0; k < 3; ++k) curl[k] = typename Lane::Real{};
    for (const Octave& octave : octaves) {
        typename Lane::Real x[3], one[3] = {};
        place_in<Lane>(octave, P, x);
        if (octave.time.f == 0)
            curl_of_octave<Lane, false>(x, octave, one);
        else
            curl_of_octave<Lane, true>(x, octave, one);
        for (int k = 0; k < 3; ++k) curl[k] += octave.amount * scale * one[k];
    }
}

}  // namespace

double noise(const Vec3d& P, const NoiseOptions& options, Vec3d* gradient)
{
    double value = 0;
    Vec3d slope = Vec3d::Zero();
    for (const Octave& octave : Octaves(options)) {
        double x[3], d[3] = {};
        place_in<One>(octave, {P.x(), P.y(), P.z()}, x);
        add_octave(x, octave, value, d);
        slope += octave.fineness * Vec3d(d[0], d[1], d[2]);
    }
    const double scale = 1 / (largest_value * geometric(roughness, options.octaves));
    if (gradient) *gradient = slope * scale;
    return value * scale;
}

Vec3d curl_noise(const Vec3d& P, const NoiseOptions& options)
{
    double curl[3];
    curl_of<One>({P.x(), P.y(), P.z()}, Octaves(options), curl_scale(options), curl);
    return {curl[0], curl[1], curl[2]};
}

void curl_noise(std::span<const Vec3d> P, const NoiseOptions& options, std::span<Vec3d> curl)
{
    const Octaves octaves(options);
    const double scale = curl_scale(options);
    // Transposes in blocks of several vectors: elements that were just stored one by one are slow to load as a vector.
    constexpr std::size_t block = 8 * Eight::size;
    Eight::Real x[3][8] = {}, result[3][8];
    for (std::size_t first = 0; first < P.size(); first += block) {
        const std::size_t count = std::min(block, P.size() - first);
        for (std::size_t i = 0; i < count; ++i)
            for (int axis = 0; axis < 3; ++axis) x[axis][i / Eight::size][i % Eight::size] = P[first + i][axis];
        for (std::size_t some = 0; some * Eight::size < count; ++some) {
            Eight::Real of_some[3];
            curl_of<Eight>({x[0][some], x[1][some], x[2][some]}, octaves, scale, of_some);
            for (int axis = 0; axis < 3; ++axis) result[axis][some] = of_some[axis];
        }
        for (std::size_t i = 0; i < count; ++i)
            for (int axis = 0; axis < 3; ++axis) curl[first + i][axis] = result[axis][i / Eight::size][i % Eight::size];
    }
}

}  // namespace rapid
