#include "runtime/operators/emit/birth_velocity.h"

#include <algorithm>
#include <array>

namespace rapid {

BirthVelocity::BirthVelocity(const Vec3d& velocity, const Interval& speed, double spread, double inherit,
                             const BirthSource& source)
    : velocity_(velocity), speed_(speed), inherit_(inherit), source_(source), cone_(spread)
{
    is_random_ = spread > 0 && (!is_zero(speed) || velocity != Vec3d::Zero());
    const bool has_v = inherit != 0 && source.has_own_velocity();
    source_v_differs_ = has_v && !source.values().v().is_uniform();
    is_common_ = !is_random_ && is_zero(speed) && !source_v_differs_ && !(inherit != 0 && source.moves());
    inherited_ =
        !has_v || source_v_differs_ ? Vec3d(Vec3d::Zero()) : Vec3d(inherit * source.values().v()[0].cast<double>());
}

void BirthVelocity::find(std::span<const Birthplace> birthplaces, std::span<const Draws> draws,
                         std::span<const Draws> speed_draws, std::span<const Vec3d> source_motion,
                         std::span<Vec3f> v) const
{
    const bool moves = inherit_ != 0 && source_.moves();
    const Strided<Vec3f> source_v = source_.values().v().read();
    std::array<Vec3d, 64> buffer;
    for (std::size_t begin = 0; begin < birthplaces.size(); begin += buffer.size()) {
        const std::size_t size = std::min(buffer.size(), birthplaces.size() - begin);
        const std::span<Vec3d> own = std::span(buffer).first(size);
        for (std::size_t k = 0; k < size; ++k) {
            const double speed = speed_.is_single() ? speed_.min : speed_.at(speed_draws[begin + k][0]);
            own[k] = velocity_ + speed * birthplaces[begin + k].N.cast<double>();
        }
        if (is_random_) cone_.turn(own, draws.subspan(begin, size));
        for (std::size_t k = 0; k < size; ++k) {
            const std::size_t i = begin + k;
            Vec3d sum = inherited_ + own[k];
            if (source_v_differs_) sum += inherit_ * source_.value(source_v, birthplaces[i]).cast<double>();
            if (moves) sum += inherit_ * source_motion[i];
            v[i] = sum.cast<float>();
        }
    }
}

}  // namespace rapid
