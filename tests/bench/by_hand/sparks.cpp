// graphs/sparks.lua by hand.
#include "tests/bench/by_hand/by_hand.h"

using namespace by_hand;

namespace {

enum { x, y, z, vx, vy, vz, age, life, heat, red, green, blue, cold, columns };

const Surface ground{0.35f, 0.2f};

template <class Time>
void step(const Points<columns>& p, std::size_t first, std::size_t last, const Time& time_of,
          std::vector<std::uint32_t>& dead)
{
    for (std::size_t begin = first; begin < last; begin += block) {
        const int n = static_cast<int>(std::min(block, last - begin));
        float* c[columns];
        for (int k = 0; k < columns; ++k) c[k] = p[k] + begin;
        std::int32_t slow[block], dies[block];
#pragma omp simd
        for (int i = 0; i < n; ++i) {
            const float dt = time_of(begin + i);
            c[vy][i] += 3 * c[heat][i] * dt;
            const float h = c[heat][i] * std::exp(-dt / 0.4f);
            c[heat][i] = h;
            c[cold][i] = h < 0.01f ? 1 : c[cold][i];
            const bool warm = h > 0.5f;
            const float t = warm ? 2 * h - 1 : 2 * h;
            c[red][i] = warm ? 1 : 0.5f + 0.5f * t;
            c[green][i] = warm ? 0.6f + 0.35f * t : 0.08f + 0.52f * t;
            c[blue][i] = warm ? 0.15f + 0.65f * t : 0.03f + 0.12f * t;
            float x1 = c[x][i], y1 = c[y][i], z1 = c[z][i], vx1 = c[vx][i], vy1 = c[vy][i], vz1 = c[vz][i];
            slow[i] = fall(ground, 0, dt, x1, y1, z1, vx1, vy1, vz1);
            c[x][i] = x1, c[y][i] = y1, c[z][i] = z1, c[vx][i] = vx1, c[vy][i] = vy1, c[vz][i] = vz1;
            c[age][i] += dt;
            dies[i] = c[age][i] >= c[life][i];
        }
        for (int i = 0; i < n; ++i) {
            if (slow[i]) {
                V P{c[x][i], c[y][i], c[z][i]}, v{c[vx][i], c[vy][i], c[vz][i]};
                bounce(ground, 0, time_of(begin + i), P, v);
                c[x][i] = P.x, c[y][i] = P.y, c[z][i] = P.z, c[vx][i] = v.x, c[vy][i] = v.y, c[vz][i] = v.z;
            }
            if (dies[i]) dead.push_back(static_cast<std::uint32_t>(begin + i));
        }
    }
}

}  // namespace

int main(int count, char** words)
{
    const auto [rate, frames] = arguments_of(count, words);
    Points<columns> p(static_cast<std::size_t>(rate * 1.7) + chunk);
    const TorusMesh wheel(0.2f, 0.02f, {0, 0.6f, 0});
    const auto due = [rate = rate](int frame) { return rate * (frame - 1) / 24; };
    return run(
        p, frames, [&](int frame) { return static_cast<std::size_t>(due(frame)); },
        [&, rate = rate](Random& random, const Birth& birth) {
            const auto [P, N] = wheel.place(random);
            const V v = turned(V{5, 2.5f, 0} + 1.5f * N, 0.2443461f, random);
            const double passed = due(birth.frame) - static_cast<double>(birth.before + birth.i + 1);
            return Newborn<columns>{{P.x, P.y, P.z, v.x, v.y, v.z, 0, 0.4f + 1.2f * random.next(), 1},
                                    static_cast<float>(passed / rate)};
        },
        [&](std::size_t first, std::size_t last, int, const auto& time_of, auto& dead) {
            step(p, first, last, time_of, dead);
        });
}
