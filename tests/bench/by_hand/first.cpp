// graphs/first.lua by hand.
#include "tests/bench/by_hand/by_hand.h"

using namespace by_hand;

namespace {

enum { x, y, z, vx, vy, vz, age, life, red, green, blue, columns };

const Surface body{0.4f, 0.2f}, ground{0.3f, 0.3f};

// The distances to the mesh's facets: each of the ring's 64 segments is a prism over a polygon with 23 sides.
const Distances& torus()
{
    constexpr float half = 3.1415927f / 64, step = 6.2831853f / 23;
    static const Distances made({-0.9f, 0.4f, -0.9f}, {0.9f, 1, 0.9f}, 0.02f, [](V P) {
        const float facet = std::remainder(std::atan2(P.z, P.x) - half, 2 * half);
        const float across = (std::hypot(P.x, P.z) * std::cos(facet) / std::cos(half)) - 0.6f, up = P.y - 0.7f;
        const float side = std::remainder(std::atan2(up, across) - 0.5f * step, step);
        const float r = std::hypot(across, up), edge = 0.22f * std::sin(0.5f * step);
        const float beside = std::max(0.0f, std::abs(r * std::sin(side)) - edge);
        const float above = r * std::cos(side) - 0.22f * std::cos(0.5f * step);
        return beside > 0 && above > 0 ? std::hypot(above, beside) : above;
    });
    return made;
}

template <class Time>
void step(const Points<columns>& p, std::size_t first, std::size_t last, const Time& time_of,
          std::vector<std::uint32_t>& dead)
{
    const StaticField field{torus()};
    Walkers walkers;
    for (std::size_t begin = first; begin < last; begin += block) {
        const int n = static_cast<int>(std::min(block, last - begin));
        float* c[columns];
        for (int k = 0; k < columns; ++k) c[k] = p[k] + begin;
        std::int32_t slow[block], dies[block];
#pragma omp simd
        for (int i = 0; i < n; ++i) {
            const float dt = time_of(begin + i);
            const float x0 = c[x][i], y0 = c[y][i], z0 = c[z][i];
            const float vx0 = c[vx][i] + 3 * dt * z0, vy0 = c[vy][i], vz0 = c[vz][i] - 3 * dt * x0;
            const float turns = c[age][i] > 1.5f ? 2 * dt : 0;
            c[red][i] += (1 - c[red][i]) * turns;
            c[green][i] += (0.45f - c[green][i]) * turns;
            c[blue][i] += (0.2f - c[blue][i]) * turns;
            const float reach = dt * (std::sqrt(vx0 * vx0 + vy0 * vy0 + vz0 * vz0) + 0.5f * gravity * dt);
            const bool near = field.clearance(x0, y0, z0) <= reach;
            float x1 = x0, y1 = y0, z1 = z0, vx1 = vx0, vy1 = vy0, vz1 = vz0;
            const bool again = fall(ground, 0, dt, x1, y1, z1, vx1, vy1, vz1);
            slow[i] = near | again;
            c[x][i] = near ? x0 : x1, c[y][i] = near ? y0 : y1, c[z][i] = near ? z0 : z1;
            c[vx][i] = near ? vx0 : vx1, c[vy][i] = near ? vy0 : vy1, c[vz][i] = near ? vz0 : vz1;
            c[age][i] += dt;
            dies[i] = c[age][i] >= c[life][i];
        }
        for (int i = 0; i < n; ++i) {
            if (slow[i])
                walkers.add(i, {c[x][i], c[y][i], c[z][i]}, {c[vx][i], c[vy][i], c[vz][i]}, {0, -gravity, 0},
                            time_of(begin + i));
            if (dies[i]) dead.push_back(static_cast<std::uint32_t>(begin + i));
        }
        walkers.walk(field, 0, body, ground, [&](int i, V P, V v) {
            c[x][i] = P.x, c[y][i] = P.y, c[z][i] = P.z, c[vx][i] = v.x, c[vy][i] = v.y, c[vz][i] = v.z;
        });
    }
}

}  // namespace

int main(int count, char** words)
{
    const auto [rate, frames] = arguments_of(count, words);
    Points<columns> p(static_cast<std::size_t>(rate * 3.5) + chunk);
    const TorusMesh ring(0.35f, 0.06f, {0, 2.2f, 0});
    torus();
    return run(
        p, frames, [rate = rate](int frame) { return static_cast<std::size_t>(rate * (frame - 1) / 24); },
        [&](Random& random, const Birth&) {
            const V P = ring.place(random).P;
            const V v = turned({0, -0.5f, 0}, 0.2617994f, random);
            return Newborn<columns>{{P.x, P.y, P.z, v.x, v.y, v.z, 0, 2.5f + random.next(), 0.25f, 0.6f, 1},
                                    frame_time * random.next()};
        },
        [&](std::size_t first, std::size_t last, int, const auto& time_of, auto& dead) {
            step(p, first, last, time_of, dead);
        });
}
