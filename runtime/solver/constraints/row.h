// One row: a scalar constraint C(x) = 0, or C(x) >= 0, between a few points, and its projection by XPBD (Macklin et al.
// 2016):
//
//   Δλ = (-C - α~ λ) / (Σ w |∇C|² + α~),   Δx = w ∇C Δλ,   α~ = α / dt²
//
// The multiplier λ is accumulated over the iterations of a sub-step: reset in each, it would make every spring rigid.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "runtime/points/id_index.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// What a constraint function says of itself (rows.h).
template <class Function>
struct FunctionTraits {
    static constexpr int arity = Function::points;

    static constexpr bool one_sided = [] {
        if constexpr (requires { Function::one_sided; }) return Function::one_sided;
        return false;
    }();

    static constexpr bool rests = [] {
        if constexpr (requires { Function::rests; }) return Function::rests;
        return false;
    }();

    static constexpr bool has_curvature = requires(const Function& function, const std::array<Vec3d, arity>& P)
    {
        function.curvature(P);
    };
};

template <class Function>
struct Row {
    static constexpr int arity = Function::points;
    using Traits = FunctionTraits<Function>;
    using Ids = std::array<std::int64_t, arity>;
    using Points = std::array<std::uint32_t, arity>;
    using Vectors = std::array<Vec3d, arity>;  // one a point

    Function function;
    double compliance;  // m/N
    Ids ids;
    Points points = filled(IdIndex::none);
    double lambda = 0, previous_lambda = 0;  // N s², of this sub-step and of the one before
    Vectors direction = zero();              // the gradient that it acts along
    Vectors acceleration = zero();           // m/s², what it gives each point, as of the last sub-step
    bool active = true, was_active = false;
    bool asleep = false;  // in this sub-step: none of its points moves, as one of them sleeps

    // The residual that the last frame ended with; exact where it is of points without velocity, as the frame began.
    double resting_residual = std::numeric_limits<double>::quiet_NaN();
    bool resting_residual_exact = false;

    // Finds its points by id. It acts while all of them are in the group. True where it acts otherwise than before.
    bool find_points(const IdIndex& index, const Strided<std::uint8_t>& members)
    {
        bool changed = false;
        active = true;
        for (int k = 0; k < arity; ++k) {
            const std::uint32_t i = index[ids[k]];
            changed |= i != points[k];
            points[k] = i;
            active &= i != IdIndex::none && members[i];
        }
        return changed;
    }
    bool has_lost_point() const { return std::find(points.begin(), points.end(), IdIndex::none) != points.end(); }

    double residual(const Substep& step, Vectors& gradient) const
    {
        return function.residual(positions(step), gradient);
    }
    Vectors positions(const Substep& step) const
    {
        Vectors P;
        for (int k = 0; k < arity; ++k) P[k] = step.points[points[k]].P;
        return P;
    }

    // A row's force acts as a kick of half a sub-step at its beginning and one at its end. The first is taken off from
    // where the free motion went and from the velocity that it gave: the projection finds it again.
    void subtract_half_kick(Substep& step) const
    {
        for (int k = 0; active && k < arity; ++k) {
            const std::uint32_t i = points[k];
            if (!(step.points[i].w > 0)) continue;
            const Mobility mobility = step.mobility_of(i);
            step.points[i].P -= (mobility.v * step.dt - mobility.x) * acceleration[k];
            step.v[i] -= 0.5 * mobility.v * acceleration[k];
        }
    }
    void add_half_kick(Substep& step, double per_dt2)
    {
        for (int k = 0; active && !asleep && k < arity; ++k) {
            const std::uint32_t i = points[k];
            const Mobility mobility = step.mobility_of(i);
            acceleration[k] = step.points[i].w * (step.dt / mobility.v) * lambda * per_dt2 * direction[k];
            step.v[i] += 0.5 * mobility.v * acceleration[k];
        }
    }

    // One-sided rows begin with the multiplier of the sub-step before.
    void warm_start(Substep& step)
    {
        Vectors P;
        for (int k = 0; k < arity; ++k) P[k] = step.start[points[k]];
        function.residual(P, direction);
        previous_lambda = lambda;
        if (Traits::one_sided)
            for (int k = 0; k < arity; ++k)
                step.points[points[k]].P += step.points[points[k]].w * lambda * direction[k];
        else
            lambda = 0;
    }

    void project(Substep& step, double per_dt2)
    {
        const Vectors P = positions(step);
        Vectors gradient;
        const double C = function.residual(P, gradient), softness = compliance * per_dt2;
        choose_direction(step, P, gradient);
        double stiffness = softness;
        for (int k = 0; k < arity; ++k) stiffness += step.points[points[k]].w * gradient[k].dot(direction[k]);
        if (!(stiffness > 0)) return;
        double change = (-C - softness * lambda) / stiffness;
        if (Traits::one_sided) change = std::max(change, -lambda);
        lambda += change;
        for (int k = 0; k < arity; ++k) {
            ProjectedPoint& point = step.points[points[k]];
            point.P += point.w * change * direction[k];
        }
    }

    // The gradient at the sub-step's beginning keeps angular momentum and is of second order (as SHAKE is). Where the
    // points have turned too far since, or are held so tightly that they would swing across it, the gradient here is
    // taken, which is of first order and always stable.
    void choose_direction(const Substep& step, const Vectors& P, const Vectors& gradient)
    {
        double same = 0, size = 0, weight = 0;
        for (int k = 0; k < arity; ++k) {
            same += gradient[k].dot(direction[k]);
            size += gradient[k].squaredNorm();
            weight += step.points[points[k]].w;
        }
        bool here = same < 0.8 * size;
        if constexpr (Traits::has_curvature)
            here |= std::abs(previous_lambda) * weight * function.curvature(P).diagonal().maxCoeff() > 0.5;
        else
            static_cast<void>(P), static_cast<void>(weight);
        if (here) direction = gradient;
    }

    // How far it is off, m: 0 where it is one-sided and satisfied.
    double error(double residual, double per_dt2) const
    {
        const double C = residual + compliance * per_dt2 * lambda;
        return Traits::one_sided ? std::min(C, 0.0) : C;
    }

private:
    static Vectors zero()
    {
        Vectors result;
        result.fill(Vec3d::Zero());
        return result;
    }
    static Points filled(std::uint32_t value)
    {
        Points result;
        result.fill(value);
        return result;
    }
};

}  // namespace rapid
