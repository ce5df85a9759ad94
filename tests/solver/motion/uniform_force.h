// Gravity, and chains of dynamics, for tests and benchmarks of the solver alone.
#pragma once

#include "runtime/solver/dynamics.h"

namespace rapid::test {

class UniformForce : public Force {
public:
    explicit UniformForce(const Vec3d& a = {0, -9.81, 0}) : a_(a) {}
    void contribute(const Chunk&, Forces& forces) const override { forces.add_uniform(a_); }
    std::optional<Uniform> uniform() const override { return Uniform{a_}; }

private:
    Vec3d a_;
};

// Returns the dynamics of a chain that adds these, in order.
template <class... D>
Dynamics chain(const D&... added)
{
    Dynamics dynamics;
    (dynamics.add(added), ...);
    return dynamics;
}

}  // namespace rapid::test
