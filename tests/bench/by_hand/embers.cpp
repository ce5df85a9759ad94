// graphs/embers.lua by hand.
#include "tests/bench/by_hand/by_hand.h"

using namespace by_hand;

namespace {

enum { x, y, z, vx, vy, vz, heat, pace, phase, cooling, red, green, blue, columns };

template <class Time>
void step(const Points<columns>& p, std::size_t first, std::size_t last, float now, const Time& time_of,
          std::vector<std::uint32_t>& dead)
{
    for (std::size_t begin = first; begin < last; begin += block) {
        const int n = static_cast<int>(std::min(block, last - begin));
        float* c[columns];
        for (int k = 0; k < columns; ++k) c[k] = p[k] + begin;
        std::int32_t dies[block];
#pragma omp simd
        for (int i = 0; i < n; ++i) {
            const float dt = time_of(begin + i), swings = c[pace][i] * now;
            const float drag = std::exp(-0.6f * dt), h = c[heat][i];
            const float u = (c[vx][i] + 1.2f * std::sin(swings + c[phase][i]) * dt) * drag;
            const float v = (c[vy][i] + (2.2f * h - 0.4f) * dt) * drag;
            const float w = (c[vz][i] + 1.2f * std::cos(1.3f * swings + c[phase][i]) * dt) * drag;
            const float cools = h * std::exp(-dt * c[cooling][i]), bright = 0.25f + 0.75f * cools;
            c[vx][i] = u, c[vy][i] = v, c[vz][i] = w;
            c[x][i] += u * dt, c[y][i] += v * dt, c[z][i] += w * dt;
            c[heat][i] = cools;
            c[red][i] = bright, c[green][i] = 0.75f * cools * bright, c[blue][i] = 0.35f * cools * cools * bright;
            dies[i] = cools < 0.06f;
        }
        for (int i = 0; i < n; ++i)
            if (dies[i]) dead.push_back(static_cast<std::uint32_t>(begin + i));
    }
}

}  // namespace

int main(int count, char** words)
{
    const auto [rate, frames] = arguments_of(count, words);
    Points<columns> p(static_cast<std::size_t>(rate * 6) + chunk);
    return run(
        p, frames, [rate = rate](int frame) { return static_cast<std::size_t>(rate * (frame - 1) / 24); },
        [](Random& random, const Birth&) {
            const V v = turned({0, 0.4f, 0}, 1.0471976f, random);
            const float px = 1.6f * random.next() - 0.8f, py = 0.15f * random.next(), pz = 0.5f * random.next() - 0.25f;
            return Newborn<columns>{{px, py, pz, v.x, v.y, v.z, 1, 1.5f + 2.5f * random.next(), 6.2832f * random.next(),
                                     1 / (0.8f + 2 * random.next())},
                                    frame_time * random.next()};
        },
        [&](std::size_t first, std::size_t last, int frame, const auto& time_of, auto& dead) {
            step(p, first, last, static_cast<float>(frame - 1) / 24, time_of, dead);
        });
}
