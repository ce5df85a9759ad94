// Mass scaling (Macklin et al. 2014): in a contact of two points, the upper one counts as lighter.
//
// With c = n·up, the upper point counts as e^(k c) times lighter than the lower one, as if mass decreased by e^(-k h /
// (r_i + r_j)) with the height h. Loads then do not add up. A contact carries
//
//   p = m g dt / (2 c sinh(k c / 2)),   as   w e^(k c / 2) c p = g dt + w e^(-k c / 2) c p
//
// under a stack of any height, w = 1/m. A warm-start impulse beyond that, as left by a fall, is dropped: its release
// would throw the light points upwards, like the end of a whip.
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/point_pack.h"

namespace rapid {

class MassScaling {
public:
    // Sets k, at least 0.
    void set(double k) { k_ = k; }
    bool is_set() const { return k_ > 0; }
    void begin(const Substep& step) { active_ = k_ > 0 && !step.up.isZero(0); }

    void apply(ContactPack& pack, const PointPack& a, const PointPack& b, const Substep& step) const
    {
        if (!active_) return;
        for (std::uint32_t l = 0; l < lanes; ++l) {
            const double c = pack.n[l].dot(step.up), scale = std::exp(0.5 * k_ * c);
            pack.scale[l] = static_cast<float>(scale);
            pack.effective_mass[l] = static_cast<float>(1 / (scale * a.w[l] + b.w[l] / scale));
            const double carried =
                step.max_acceleration * step.dt / ((c > 0 ? a.w[l] : b.w[l]) * std::abs(c * (scale - 1 / scale)));
            pack.normal_impulse[l] = pack.carried_impulse[l] =
                std::min(pack.normal_impulse[l], static_cast<float>(0.5 * carried));
        }
    }

    // Calls f(weights), with weights(pack, a, b) the inverse masses of the contacts' points. Unscaled masses use a
    // separate type, at no cost.
    template <class F>
    void with_weights(const F& f) const
    {
        struct Weights {
            Doubles a, b;
        };
        if (!active_)
            f([](const ContactPack&, const PointPack& a, const PointPack& b) { return Weights{a.w, b.w}; });
        else
            f([](const ContactPack& pack, const PointPack& a, const PointPack& b) {
                const Doubles scale = widen(pack.scale);
                return Weights{scale * a.w, b.w / scale};
            });
    }

private:
    double k_ = 0;
    bool active_ = false;  // in this substep
};

}  // namespace rapid
