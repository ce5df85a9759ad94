// Forces whose parameters are functions of the frame, as the shadows of the error estimate have them.
//
// Such a function is called at the end of each frame, and Solve holds its value through the frame: order 1. The shadows
// have the force of the frame before in the first half of a frame, or where both are uniform their mean, which is order
// 2: so they part from their points by what holding it is off by.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "runtime/solver/dynamics.h"

namespace rapid {

class VaryingForces {
public:
    // Call in each frame. The dynamics for its shadows, until the next call: those given, where no force varies.
    // varies(node): whether a parameter of the node does. middle: s since the start, of the frame.
    template <class F>
    const Dynamics& begin(const Dynamics& dynamics, const F& varies, double middle)
    {
        const auto before = std::exchange(forces_, {});
        for (const auto& force : dynamics.forces())
            if (varies(force->node)) forces_[force->node] = force;
        any_ = !forces_.empty();
        if (!any_) return dynamics;
        replace(dynamics, before, middle);
        return dynamics_;
    }
    bool any() const { return any_; }

private:
    using ForcesByNode = std::map<std::string, std::shared_ptr<const Force>>;

    void replace(const Dynamics& dynamics, const ForcesByNode& before, double middle);

    ForcesByNode forces_;  // of this frame, that vary
    Dynamics dynamics_;
    bool any_ = false;
};

}  // namespace rapid
