// turbulence: a divergence-free random acceleration.
//
//   a = amplitude curl_noise(P / size, speed time)        (noise.h; Bridson et al. 2007)
#include "runtime/graph/node.h"
#include "runtime/math/noise.h"

namespace rapid {
namespace {

class TurbulentForce : public Force {
public:
    PerPoint<float> amplitude;
    double size, speed;
    NoiseOptions noise;

    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        const Strided<float> strength = chunk.read(amplitude);
        std::vector<Vec3d> scaled(chunk.size()), curl(chunk.size());
        const double* P = coordinates(chunk.P);
        double* x = scaled.data()->data();
        for (std::size_t l = 0; l < 3 * chunk.size(); ++l) x[l] = P[l] / size;
        // Evaluates points with the same time together; newborn points have individual times.
        for (std::size_t begin = 0; begin < chunk.size();) {
            std::size_t end = begin + 1;
            while (end < chunk.size() && chunk.time[end] == chunk.time[begin]) ++end;
            NoiseOptions now = noise;
            now.time = speed * chunk.time[begin];
            curl_noise(std::span<const Vec3d>(scaled).subspan(begin, end - begin), now,
                       std::span(curl).subspan(begin, end - begin));
            begin = end;
        }
        const std::span<Vec3d> a = forces.accelerations();
        for (std::size_t i = 0; i < chunk.size(); ++i) a[i] += strength[i] * curl[i];
    }
};

struct Turbulence {
    PerPoint<float> amplitude;
    double size, speed;
    int octaves, seed;
    std::string group;

    static NodeType declare()
    {
        return node<Turbulence>("turbulence", "Accelerates points by a random field of eddies.")
            .stage(Stage::Forces)
            .param(&Turbulence::amplitude, "amplitude", 1.0, any_number(), "m/s²", "root mean square acceleration")
            .param(&Turbulence::size, "size", 1.0, above(0), "m", "size of the largest eddies")
            .param(&Turbulence::speed, "speed", 0.0, at_least(0), "1/s", "rate at which the field changes")
            .param(&Turbulence::octaves, "octaves", 3.0, between(1, NoiseOptions::max_octaves), "",
                   "number of scales, each with eddies half as large and half as strong")
            .param(&Turbulence::seed, "seed", 0.0, at_least(0), "", "seed of the field")
            .varies();
    }

    std::shared_ptr<const Force> dynamic(const Evaluation& now) const
    {
        auto force = dynamic_of<TurbulentForce>(now, group);
        force->amplitude = amplitude;
        force->size = size;
        force->speed = speed;
        force->noise.octaves = octaves;
        force->noise.seed = static_cast<std::uint32_t>(seed);
        return force;
    }
};
RAPID_NODE(Turbulence);

}  // namespace
}  // namespace rapid
