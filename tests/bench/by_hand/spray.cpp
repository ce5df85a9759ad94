// graphs/spray.lua by hand.
#include "tests/bench/by_hand/by_hand.h"

using namespace by_hand;

namespace {

enum { x, y, z, vx, vy, vz, age, columns };

constexpr float radius = 0.008f;
const Surface body{0.15f, 0.05f}, ground{0.25f, 0.15f};

const Distances& ball()
{
    static const Distances made({0.2f, -0.1f, -0.6f}, {1.4f, 1.1f, 0.6f}, 0.025f, [](V P) {
        return length(P - V{0.8f, 0.5f, 0}) - 0.5f;
    });
    return made;
}

template <class Time>
void step(const Points<columns>& p, std::size_t first, std::size_t last, const Time& time_of,
          std::vector<std::uint32_t>& dead)
{
    const StaticField field{ball()};
    Walkers walkers;
    for (std::size_t begin = first; begin < last; begin += block) {
        const int n = static_cast<int>(std::min(block, last - begin));
        float* c[columns];
        for (int k = 0; k < columns; ++k) c[k] = p[k] + begin;
        std::int32_t slow[block], dies[block];
#pragma omp simd
        for (int i = 0; i < n; ++i) {
            const float dt = time_of(begin + i);
            const float x0 = c[x][i], y0 = c[y][i], z0 = c[z][i], vx0 = c[vx][i], vy0 = c[vy][i], vz0 = c[vz][i];
            const float reach = dt * (std::sqrt(vx0 * vx0 + vy0 * vy0 + vz0 * vz0) + 0.5f * gravity * dt) + radius;
            const bool near = field.clearance(x0, y0, z0) <= reach;
            float x1 = x0, y1 = y0, z1 = z0, vx1 = vx0, vy1 = vy0, vz1 = vz0;
            const bool again = fall(ground, radius, dt, x1, y1, z1, vx1, vy1, vz1);
            slow[i] = near | again;
            c[x][i] = near ? x0 : x1, c[y][i] = near ? y0 : y1, c[z][i] = near ? z0 : z1;
            c[vx][i] = near ? vx0 : vx1, c[vy][i] = near ? vy0 : vy1, c[vz][i] = near ? vz0 : vz1;
            c[age][i] += dt;
            dies[i] = c[age][i] >= 2.5f;
        }
        for (int i = 0; i < n; ++i) {
            if (slow[i])
                walkers.add(i, {c[x][i], c[y][i], c[z][i]}, {c[vx][i], c[vy][i], c[vz][i]}, {0, -gravity, 0},
                            time_of(begin + i));
            if (dies[i]) dead.push_back(static_cast<std::uint32_t>(begin + i));
        }
        walkers.walk(field, radius, body, ground, [&](int i, V P, V v) {
            c[x][i] = P.x, c[y][i] = P.y, c[z][i] = P.z, c[vx][i] = v.x, c[vy][i] = v.y, c[vz][i] = v.z;
        });
    }
}

}  // namespace

int main(int count, char** words)
{
    const auto [rate, frames] = arguments_of(count, words);
    Points<columns> p(static_cast<std::size_t>(rate * 2.6) + chunk);
    ball();
    return run(
        p, frames,
        [rate = rate, due = 0.0](int frame) mutable {
            due += rate * (0.55 + 0.45 * std::cos(9 * (frame - 1) / 24.0)) / 24;
            return static_cast<std::size_t>(due);
        },
        [&](Random& random, const Birth&) {
            const V v = turned({2.1f, 5.2f, 0}, 0.08726646f, random);
            const float px = -1.18f + 0.16f * random.next(), pz = -0.08f + 0.16f * random.next();
            return Newborn<columns>{{px, 0.3f, pz, v.x, v.y, v.z, 0}, frame_time * random.next()};
        },
        [&](std::size_t first, std::size_t last, int, const auto& time_of, auto& dead) {
            step(p, first, last, time_of, dead);
        });
}
