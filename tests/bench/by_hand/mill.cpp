// graphs/mill.lua by hand, with two substeps per frame and without an error estimate.
#include "tests/bench/by_hand/by_hand.h"

using namespace by_hand;

namespace {

enum { x, y, z, vx, vy, vz, age, red, green, blue, columns };

constexpr int substeps = 2;
constexpr float turns = 2.0943951f;  // rad/s, clockwise
const Surface body{0.3f, 0.3f}, ground{0.2f, 0.4f};

const Distances& cross()
{
    static const Distances made({-1, -1, -0.6f}, {1, 1, 0.6f}, 0.025f, [](V P) {
        const auto box = [&](float a, float b, float c) {
            const V q{std::abs(P.x) - a, std::abs(P.y) - b, std::abs(P.z) - c};
            const V out{std::max(q.x, 0.0f), std::max(q.y, 0.0f), std::max(q.z, 0.0f)};
            return length(out) + std::min(0.0f, std::max({q.x, q.y, q.z}));
        };
        return std::min(box(0.8f, 0.075f, 0.4f), box(0.075f, 0.8f, 0.4f));
    });
    return made;
}

// The rotating cross, from a time on.
struct Paddles {
    const Distances& table = cross();
    float c, s;  // of the initial angle

    explicit Paddles(float time) : c(std::cos(turns * time)), s(std::sin(turns * time)) {}

    static constexpr float fastest = 1.7f;
    void angle(float later, float& cosine, float& sine) const
    {
        const float a = turns * later, u = 1 - a * a * (0.5f - a * a * (1 / 24.0f)), w = a - a * a * a * (1 / 6.0f);
        cosine = c * u - s * w, sine = s * u + c * w;
    }
    float clearance(float px, float py, float pz) const
    {
        py -= 1.1f;
        return table.clearance(c * px - s * py, s * px + c * py, pz);
    }
    float distance(float px, float py, float pz, float later) const
    {
        float co, si;
        angle(later, co, si);
        py -= 1.1f;
        return table.distance(co * px - si * py, si * px + co * py, pz);
    }
    V normal(V P, float later) const
    {
        float co, si;
        angle(later, co, si);
        P.y -= 1.1f;
        const V n = table.normal({co * P.x - si * P.y, si * P.x + co * P.y, P.z});
        return {co * n.x + si * n.y, co * n.y - si * n.x, n.z};
    }
    V velocity(V P) const { return {turns * (P.y - 1.1f), -turns * P.x, 0}; }
};

inline std::uint32_t mixed(std::uint32_t u)
{
    u ^= u >> 16, u *= 0x7feb352du, u ^= u >> 15, u *= 0x846ca68bu, u ^= u >> 16;
    return u;
}

// One axis of a cell of the noise's lattice.
struct Axis {
    std::uint32_t corner;
    float f, s, slope;

    explicit Axis(float at)
    {
        const float below = std::floor(at);
        corner = static_cast<std::uint32_t>(static_cast<std::int32_t>(below));
        f = at - below;
        s = f * f * f * (f * (f * 6 - 15) + 10);
        slope = f * f * (f * (f * 30 - 60) + 30);
    }
};

inline float component(std::uint32_t bits, std::uint32_t axis)
{
    const float sign = (bits >> (2 + axis) & 1) != 0 ? 1.0f : -1.0f;
    return (bits & 3) == axis ? 0 : sign;
}

// Adds the curl of noise of three octaves that change with time (runtime/math/noise.h) to the accelerations.
void add_turbulence(int n, const float* px, const float* py, const float* pz, float time, float amplitude, float size,
                    float* ax, float* ay, float* az)
{
    const float scale = amplitude / (1.83f * std::sqrt(1.3125f));
    float amount = scale, fineness = 1;
    for (int k = 0; k < 3; ++k, amount *= 0.5f, fineness *= 2) {
        const float shift = 0.618034f * static_cast<float>(k);
        const Axis at(time * fineness);
        const std::uint32_t hash = mixed(0x9e3779b9u * static_cast<std::uint32_t>(k)) + at.corner;
        const std::uint32_t hashes[2] = {mixed(hash), mixed(hash + 1)};
        for (int w = 0; w < 2; ++w) {
            const std::uint32_t hash_w = hashes[w];
            const float weight_w = amount * (w ? at.s : 1 - at.s), to_w = at.f - static_cast<float>(w);
            const float by = fineness / size;
#pragma omp simd
            for (int i = 0; i < n; ++i) {
                const Axis u(px[i] * by + shift), v(py[i] * by + 2 * shift), q(pz[i] * by + 3 * shift);
                float cx = 0, cy = 0, cz = 0;
                const auto corner = [&](std::uint32_t dx, std::uint32_t dy, std::uint32_t dz) {
                    std::uint32_t bits = mixed(u.corner + dx + mixed(v.corner + dy + mixed(q.corner + dz + hash_w)));
                    const float wx = dx ? u.s : 1 - u.s, wy = dy ? v.s : 1 - v.s, wz = weight_w * (dz ? q.s : 1 - q.s);
                    const float sx = dx ? u.slope : -u.slope, sy = dy ? v.slope : -v.slope,
                                sz = weight_w * (dz ? q.slope : -q.slope);
                    const float tx = u.f - static_cast<float>(dx), ty = v.f - static_cast<float>(dy),
                                tz = q.f - static_cast<float>(dz);
                    const float weight = wx * wy * wz, gx = sx * wy * wz, gy = wx * sy * wz, gz = wx * wy * sz;
                    const float a0 = component(bits, 0), a1 = component(bits, 1), a2 = component(bits, 2);
                    const float along_a = a0 * tx + a1 * ty + a2 * tz + component(bits, 3) * to_w;
                    bits >>= 6;
                    const float b0 = component(bits, 0), b1 = component(bits, 1), b2 = component(bits, 2);
                    const float along_b = b0 * tx + b1 * ty + b2 * tz + component(bits, 3) * to_w;
                    bits >>= 6;
                    const float c0 = component(bits, 0), c1 = component(bits, 1), c2 = component(bits, 2);
                    const float along_c = c0 * tx + c1 * ty + c2 * tz + component(bits, 3) * to_w;
                    cx += weight * (c1 - b2) + (gy * along_c - gz * along_b);
                    cy += weight * (a2 - c0) + (gz * along_a - gx * along_c);
                    cz += weight * (b0 - a1) + (gx * along_b - gy * along_a);
                };
                corner(0, 0, 0), corner(1, 0, 0), corner(0, 1, 0), corner(1, 1, 0);
                corner(0, 0, 1), corner(1, 0, 1), corner(0, 1, 1), corner(1, 1, 1);
                ax[i] += cx, ay[i] += cy, az[i] += cz;
            }
        }
    }
}

// Advances a substep. end: s since the start of the frame; part: the fraction of each point's own step.
template <class Time>
void substep(const Points<columns>& p, std::size_t begin, int n, float end, float part, const Time& time_of)
{
    float* c[columns];
    for (int k = 0; k < columns; ++k) c[k] = p[k] + begin;
    float mx[block], my[block], mz[block], ax[block] = {}, ay[block] = {}, az[block] = {};
    std::int32_t slow[block];
    const float length_of_step = time_of(begin);
    const float time = end - (1 - part) * length_of_step;
    const Paddles field(time);
#pragma omp simd
    for (int i = 0; i < n; ++i) {
        const float half = 0.5f / substeps * time_of(begin + i);
        mx[i] = c[x][i] + half * c[vx][i], my[i] = c[y][i] + half * c[vy][i], mz[i] = c[z][i] + half * c[vz][i];
    }
    add_turbulence(n, mx, my, mz, 0.5f * (time + 0.5f / substeps * length_of_step), 2, 0.8f, ax, ay, az);
#pragma omp simd
    for (int i = 0; i < n; ++i) {
        const float dt = time_of(begin + i) * (1.0f / substeps);
        const float left = (1 - std::exp(-0.3f * dt)) / dt;  // of the velocity relative to the wind's, per second
        const float u = c[vx][i], v = c[vy][i], w = c[vz][i];
        const float a = left * (3 + ax[i] / 0.3f - u), b = left * ((ay[i] - gravity) / 0.3f - v),
                    d = left * (az[i] / 0.3f - w);
        ax[i] = a, ay[i] = b, az[i] = d;
        const float fast = std::sqrt(u * u + v * v + w * w), pull = std::sqrt(a * a + b * b + d * d);
        const float reach = dt * (fast + 0.5f * pull * dt + Paddles::fastest);
        const float below = c[y][i] + dt * (v + 0.5f * dt * b);
        const bool near = field.clearance(c[x][i], c[y][i], c[z][i]) <= reach, stops = near | (below <= 0);
        slow[i] = stops;
        const float moves = stops ? 0 : dt;
        c[x][i] += moves * (u + 0.5f * dt * a), c[y][i] += moves * (v + 0.5f * dt * b);
        c[z][i] += moves * (w + 0.5f * dt * d);
        c[vx][i] += moves * a, c[vy][i] += moves * b, c[vz][i] += moves * d;
        const float mixes = 4 * dt;
        const bool glows = fast > 4;
        c[red][i] += ((glows ? 1 : 0.95f) - c[red][i]) * mixes;
        c[green][i] += ((glows ? 0.35f : 0.8f) - c[green][i]) * mixes;
        c[blue][i] += ((glows ? 0.1f : 0.35f) - c[blue][i]) * mixes;
    }
    Walkers walkers;
    for (int i = 0; i < n; ++i)
        if (slow[i])
            walkers.add(i, {c[x][i], c[y][i], c[z][i]}, {c[vx][i], c[vy][i], c[vz][i]}, {ax[i], ay[i], az[i]},
                        time_of(begin + i) / substeps);
    walkers.walk(field, 0, body, ground, [&](int i, V P, V v) {
        c[x][i] = P.x, c[y][i] = P.y, c[z][i] = P.z, c[vx][i] = v.x, c[vy][i] = v.y, c[vz][i] = v.z;
    });
}

template <class Time>
void step(const Points<columns>& p, std::size_t first, std::size_t last, float end, const Time& time_of,
          std::vector<std::uint32_t>& dead)
{
    for (std::size_t begin = first; begin < last; begin += block) {
        const int n = static_cast<int>(std::min(block, last - begin));
        for (int k = 0; k < substeps; ++k) substep(p, begin, n, end, static_cast<float>(k) / substeps, time_of);
        float* a = p[age] + begin;
#pragma omp simd
        for (int i = 0; i < n; ++i) a[i] += time_of(begin + i);
        for (int i = 0; i < n; ++i)
            if (a[i] >= 3) dead.push_back(static_cast<std::uint32_t>(begin + i));
    }
}

}  // namespace

int main(int count, char** words)
{
    const auto [rate, frames] = arguments_of(count, words);
    Points<columns> p(static_cast<std::size_t>(rate * 3.1) + chunk);
    cross();
    return run<columns, true>(
        p, frames, [rate = rate](int frame) { return static_cast<std::size_t>(rate * (frame - 1) / 24); },
        [](Random& random, const Birth&) {
            // The box's faces by area: top and bottom, front and back, left and right.
            const float u = random.next() - 0.5f, v = random.next() - 0.5f, face = random.next() * 0.82f;
            const float side = random.next() < 0.5f ? -0.5f : 0.5f;
            const V at = face < 0.7f ? V{u, side, v} : face < 0.77f ? V{u, v, side} : V{side, u, v};
            const V velocity = turned({0, -1, 0}, 0.1396263f, random);
            return Newborn<columns>{{0.25f + 0.7f * at.x, 2.4f + 0.05f * at.y, 0.5f * at.z, velocity.x, velocity.y,
                                     velocity.z, 0, 0.95f, 0.8f, 0.35f},
                                    frame_time * random.next()};
        },
        [&](std::size_t first, std::size_t last, int frame, const auto& time_of, auto& dead) {
            step(p, first, last, static_cast<float>(frame - 1) / 24, time_of, dead);
        });
}
