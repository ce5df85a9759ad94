// graphs/magic.lua by hand.
#include "tests/bench/by_hand/by_hand.h"

using namespace by_hand;

namespace {

enum { x, y, z, vx, vy, vz, age, life, red, green, blue, loose, columns };

// Random numbers of a point in a frame by hashing, so that the loop has no state.
inline std::uint32_t mixed(std::uint32_t u)
{
    u ^= u >> 16, u *= 0x7feb352du, u ^= u >> 15, u *= 0x846ca68bu, u ^= u >> 16;
    return u;
}
inline float uniform(std::uint32_t u) { return static_cast<float>(static_cast<std::int32_t>(u >> 8)) * 0x1p-24f; }

template <class Time>
void step(const Points<columns>& p, std::size_t first, std::size_t last, std::uint32_t frame, const Time& time_of,
          std::vector<std::uint32_t>& dead)
{
    for (std::size_t begin = first; begin < last; begin += block) {
        const int n = static_cast<int>(std::min(block, last - begin));
        float* c[columns];
        for (int k = 0; k < columns; ++k) c[k] = p[k] + begin;
        std::int32_t dies[block];
        const auto key = mixed(static_cast<std::uint32_t>(begin) ^ mixed(frame));
#pragma omp simd
        for (int i = 0; i < n; ++i) {
            const float dt = time_of(begin + i), angle = 5 * dt;
            const float co = std::cos(angle), si = std::sin(angle), pull = std::exp(-0.35f * dt);
            const float x0 = c[x][i], z0 = c[z][i];
            const float is_loose = c[age][i] > 0.9f ? 1 : c[loose][i], kick = 14 * dt * is_loose;
            c[loose][i] = is_loose;
            const std::uint32_t a = mixed(key + 3 * static_cast<std::uint32_t>(i)), b = mixed(a + 1), d = mixed(b + 1);
            const float u = c[vx][i] + kick * (uniform(a) - 0.5f), v = c[vy][i] + kick * (uniform(b) - 0.5f),
                        w = c[vz][i] + kick * (uniform(d) - 0.5f);
            c[vx][i] = u, c[vy][i] = v, c[vz][i] = w;
            c[x][i] = (co * x0 + si * z0) * pull + u * dt;
            c[y][i] += v * dt;
            c[z][i] = (co * z0 - si * x0) * pull + w * dt;
            c[age][i] += dt;
            dies[i] = c[age][i] >= c[life][i];
        }
        for (int i = 0; i < n; ++i)
            if (dies[i]) dead.push_back(static_cast<std::uint32_t>(begin + i));
    }
}

}  // namespace

int main(int count, char** words)
{
    const auto [rate, frames] = arguments_of(count, words);
    Points<columns> p(static_cast<std::size_t>(2 * rate * 2.1) + chunk);
    const auto due = [rate = rate](int frame) { return rate * (frame - 1) / 24; };  // from each of the two rings
    return run(
        p, frames, [&](int frame) { return 2 * static_cast<std::size_t>(due(frame)); },
        [&, rate = rate](Random& random, const Birth& birth) {
            const std::size_t each = birth.births / 2;
            const bool upper = birth.i >= each;
            const float angle = std::floor(12 * random.next()) * 0.5235988f, radius = upper ? 0.35f : 0.7f;
            const double passed = due(birth.frame) - static_cast<double>(birth.before / 2 + birth.i % each + 1);
            return Newborn<columns>{
                {radius * std::cos(angle), upper ? 2.3f : 0.1f, radius * std::sin(angle), 0, upper ? -1.1f : 1.1f, 0, 0,
                 1.2f + 0.8f * random.next(), upper ? 1 : 0.35f, upper ? 0.4f : 0.55f, upper ? 0.8f : 1, 0},
                static_cast<float>(passed / rate)};
        },
        [&](std::size_t first, std::size_t last, int frame, const auto& time_of, auto& dead) {
            step(p, first, last, frame, time_of, dead);
        });
}
