// One row: a scalar constraint C(x) = 0, or C(x) >= 0, between a few points. Its impulse changes their velocities by
//
//   Δv = w ∇C p
//
// with w their inverse masses. Two-sided rows apply their own force over a substep first, without adding or removing
// energy (system_motion.h, system_motion.h). The code here then accounts for contacts, shapes and other constraints
// that pushed their points since. One-sided rows do all of their work here, like contacts.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "runtime/points/id_index.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Optional properties of a constraint function (rows.h).
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

    static constexpr bool limited = one_sided && requires(Function f) { f.strength; };
};

// Returns the change of a spring's C divided by dt, per N s of impulses of others on its points, 1/kg.
inline double softness_of(double compliance, bool is_resolved, double dt)
{
    return (is_resolved ? 4 : 2) * compliance / (dt * dt);
}

template <class Function>
struct Row {
    static constexpr int arity = Function::points;
    using Traits = FunctionTraits<Function>;
    using Ids = std::array<std::int64_t, arity>;
    using Points = std::array<std::uint32_t, arity>;
    using Vectors = std::array<Vec3d, arity>;  // one per point

    Function function;
    double compliance;  // m/N
    Ids ids;
    Points points = filled(IdIndex::none);
    double impulse = 0;          // N s along the gradient, of the last substep; at least 0 if one-sided
    bool is_overloaded = false;  // in this substep: satisfying C needs more force than a one-sided row has
    double first = 0;            // C at the beginning of the substep
    double reference = 0;        // target of C after the row's own force has acted
    double added = 0;            // N s, the part of the impulse due to others, as far as it moves positions
    bool has_yielded = false;    // in a substep of this frame
    bool is_resolved = false;    // by the substep: velocities along the row remain
    double softness = 0;         // 1/kg: change of C - reference divided by dt, per N s of `added`
    Vectors direction = zero();  // the gradient along which it acts
    bool active = true, was_active = false;
    bool asleep = false;  // in this substep: none of its points moves, because one of them sleeps

    // The residual at the end of the last frame; exact if measured at the start of a frame for points without
    // velocity.
    double resting_residual = std::numeric_limits<double>::quiet_NaN();
    bool resting_residual_exact = false;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(function, compliance, ids, points, impulse, first, reference, added, has_yielded, is_resolved, softness,
             direction, active, was_active, asleep, resting_residual, resting_residual_exact);
    }

    // Returns true if a loaded row is between different points and has a valid compliance.
    bool is_possible() const
    {
        for (int k = 1; k < arity; ++k)
            if (std::find(ids.begin(), ids.begin() + k, ids[k]) != ids.begin() + k) return false;
        return compliance >= 0 && std::isfinite(compliance);
    }

    // Finds its points by id. It acts only if all of them are in the group. Returns true if its points have changed.
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

    // Measures C at the beginning of the substep.
    void measure(const Substep& step)
    {
        Vectors P, gradient;
        for (int k = 0; k < arity; ++k) P[k] = step.start[points[k]];
        first = function.residual(P, gradient);
    }
    // Makes the row keep its points at their current positions. Changes by others affect its force throughout the
    // substep, as the force follows C: α ΔF = -θ ΔC (system_motion.h). Half of the impulse ΔF dt moves positions.
    void keep(const Substep& step)
    {
        Vectors gradient;
        reference = residual(step, gradient);
        added = 0;
        is_resolved = !is_stiff(inverse_mass(step, gradient), step.dt);
        softness = softness_of(compliance, is_resolved, step.dt);
    }
    // Updates the force of a row whose points held against others by their mass (constraint.h).
    void settle(Substep& step)
    {
        Vectors gradient;
        const double change = (reference - residual(step, gradient)) / (softness * step.dt);
        take(change);
        if (!is_resolved) return;
        for (int k = 0; k < arity; ++k) step.v[points[k]] += step.points[points[k]].w * change * gradient[k];
    }

    // Returns the rate of the residual, due to the motion of the points and of the function's target.
    double rate(const Substep& step, const Vectors& gradient) const
    {
        double sum = 0;
        if constexpr (requires { function.rate(); }) sum = function.rate();
        for (int k = 0; k < arity; ++k) sum += gradient[k].dot(step.v[points[k]]);
        return sum;
    }
    // Returns the change in the residual's rate per impulse, 1/kg.
    double inverse_mass(const Substep& step, const Vectors& gradient) const
    {
        double sum = 0;
        for (int k = 0; k < arity; ++k) sum += step.points[points[k]].w * gradient[k].squaredNorm();
        return sum;
    }

    // Returns true if a spring is too stiff for the substep to resolve. It then acts as a compliant rod. W: inverse
    // mass.
    bool is_stiff(double W, double dt) const { return compliance < W * dt * dt; }

    // Starts a one-sided row with half of its last impulse on positions, and all of it on velocities, like a constant
    // force throughout the substep.
    void warm_start(Substep& step)
    {
        Vectors P;
        for (int k = 0; k < arity; ++k) P[k] = step.start[points[k]];
        reference = compliance > 0 ? 0 : std::min(0.0, function.residual(P, direction));
        softness = compliance / (step.dt * step.dt);
        residual(step, direction);
        if constexpr (Traits::limited) impulse = std::min(impulse, function.strength * step.dt);
        added = 0.5 * impulse;  // velocities get this part with the positions (Projection::advance)
        for (int k = 0; k < arity; ++k) {
            ProjectedPoint& point = step.points[points[k]];
            point.P += point.w * step.dt * added * direction[k];
            step.v[points[k]] += point.w * (impulse - added) * direction[k];
        }
    }

    // Keeps C at the reference, or above it. An earlier residual is not made worse and adds no speed.
    void project(Substep& step)
    {
        const Vectors P = positions(step);
        Vectors gradient;
        const double C = function.residual(P, gradient) - reference;
        if (!Traits::one_sided) direction = gradient;
        double along = 0;
        for (int k = 0; k < arity; ++k) along += step.points[points[k]].w * gradient[k].dot(direction[k]);
        if (!(along + softness > 0)) return;
        // A direction that has turned needs a larger impulse along it, which is unbounded; limit it to twice the
        // normal one.
        const double stiffness = softness + std::max(along, 0.5 * inverse_mass(step, gradient));
        const double total = Traits::one_sided ? impulse : added;
        double change = (-C / step.dt - softness * total) / stiffness;
        if (Traits::one_sided) {
            is_overloaded = false;
            change = limited(std::max(change, -added), step.dt);
        }
        take(change);
        for (int k = 0; k < arity; ++k) {
            ProjectedPoint& point = step.points[points[k]];
            const Vec3d shift = point.w * change * direction[k];
            point.P += step.dt * shift;
            if (is_resolved) step.v[points[k]] += shift;
        }
    }
    // Records an impulse that moves positions.
    void take(double change)
    {
        added += change;
        impulse += !Traits::one_sided && compliance > 0 ? 2 * change : change;
    }

    // Removes the velocity along a rigid row.
    void solve_velocity(Substep& step)
    {
        Vectors gradient;
        const double C = residual(step, gradient), W = inverse_mass(step, gradient);
        if (!(W > 0) || !is_stiff(W, step.dt)) return;
        double change = -rate(step, gradient) / W;
        if (Traits::one_sided) {
            if (!(impulse > 0 || C < 0)) return;
            change = limited(std::max(change, -impulse), step.dt);
        }
        impulse += change;
        for (int k = 0; k < arity; ++k) step.v[points[k]] += step.points[points[k]].w * change * gradient[k];
    }

    // Moves the points to C = 0 without adding velocity.
    void correct_position(Substep& step) const
    {
        if (compliance > 0 || is_overloaded) return;
        Vectors gradient;
        const double C = residual(step, gradient), W = inverse_mass(step, gradient);
        if (!(W > 0) || (Traits::one_sided && !(C < 0))) return;
        for (int k = 0; k < arity; ++k) {
            const std::uint32_t i = points[k];
            const Vec3d shift = -step.points[i].w * (C / W) * gradient[k];
            step.points[i].P += shift;
            if (!Traits::one_sided) step.start[i] += shift;
        }
    }

    // Returns the position error, m, if C is `residual`; for a spring, relative to the length that fits its own force.
    double error(double residual, double dt) const
    {
        if (Traits::one_sided) return std::min(residual + compliance * impulse / dt, 0.0);
        return compliance > 0 ? residual - reference + softness * dt * added : residual;
    }

private:
    // Returns the part of a change of the impulse that the strength of the row allows.
    double limited(double change, double dt)
    {
        if constexpr (Traits::limited) {
            const double allowed = function.strength * dt - impulse;
            if (change != 0) is_overloaded = change > allowed;
            change = std::min(change, allowed);
        }
        return change;
    }
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

// Computes the gradient along which a force that is constant throughout a substep does the work F (C(to) - C(from))
// and exerts no torque (Gonzalez 1996); for a distance |d| it is (d + d')/(|d| + |d'|). Functions without one use the
// gradient at the midpoint, which has these properties to second order.
template <class Function>
void discrete_gradient(const Function& function, const typename Row<Function>::Vectors& from,
                       const typename Row<Function>::Vectors& to, typename Row<Function>::Vectors& gradient)
{
    if constexpr (requires { function.discrete_gradient(from, to, gradient); }) {
        function.discrete_gradient(from, to, gradient);
    } else {
        typename Row<Function>::Vectors middle;
        for (std::size_t k = 0; k < middle.size(); ++k) middle[k] = 0.5 * (from[k] + to[k]);
        function.residual(middle, gradient);
    }
}

}  // namespace rapid
