// One row: a scalar constraint C(x) = 0, or C(x) >= 0, between a few points. What its impulse does to them is
//
//   Δv = w ∇C p
//
// with w their inverse masses. Two-sided rows carry their own force through a sub-step (tree_motion.h, row_system.h),
// which neither gives nor takes energy; here is what they do where contacts, shapes and other constraints have pushed
// their points since. One-sided rows do all of their work here, as contacts do.
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
};

// 1/kg: what C of a spring gives way by, times dt, for each N s that others move its points by.
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
    using Vectors = std::array<Vec3d, arity>;  // one a point

    Function function;
    double compliance;  // m/N
    Ids ids;
    Points points = filled(IdIndex::none);
    double impulse = 0;          // N s along the gradient, of the last sub-step; at least 0 where it is one-sided
    double first = 0;            // C where the sub-step begins
    double reference = 0;        // C that its points are kept at, once the row's own force has acted
    double added = 0;            // N s, the part of the impulse that is due to others, as far as it moves positions
    bool has_yielded = false;    // in a sub-step of this frame
    bool is_resolved = false;    // by the sub-step: velocities along the row stay
    double softness = 0;         // 1/kg: what C - reference gives way by, times dt, for each N s of `added`
    Vectors direction = zero();  // the gradient that it acts along
    bool active = true, was_active = false;
    bool asleep = false;  // in this sub-step: none of its points moves, as one of them sleeps

    // The residual that the last frame ended with; exact where it is of points without velocity, as the frame began.
    double resting_residual = std::numeric_limits<double>::quiet_NaN();
    bool resting_residual_exact = false;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(function, compliance, ids, points, impulse, first, reference, added, has_yielded, is_resolved, softness,
             direction, active, was_active, asleep, resting_residual, resting_residual_exact);
    }

    // Of a snapshot: whether it is one between different points.
    bool is_possible() const
    {
        for (int k = 1; k < arity; ++k)
            if (std::find(ids.begin(), ids.begin() + k, ids[k]) != ids.begin() + k) return false;
        return compliance >= 0 && std::isfinite(compliance);
    }

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

    // Before the sub-step.
    void measure(const Substep& step)
    {
        Vectors P, gradient;
        for (int k = 0; k < arity; ++k) P[k] = step.start[points[k]];
        first = function.residual(P, gradient);
    }
    // From here on the row keeps its points as they are now. What others do to them changes its force throughout the
    // sub-step, as the force itself goes by C: α ΔF = -θ ΔC (tree_motion.h). Of the impulse ΔF dt half moves positions.
    void keep(const Substep& step)
    {
        Vectors gradient;
        reference = residual(step, gradient);
        added = 0;
        is_resolved = !is_stiff(inverse_mass(step, gradient), step.dt);
        softness = softness_of(compliance, is_resolved, step.dt);
    }
    // Of the points that have been held against others by their mass (holding.h): what the force has come to.
    void settle(Substep& step)
    {
        Vectors gradient;
        const double change = (reference - residual(step, gradient)) / (softness * step.dt);
        take(change);
        if (!is_resolved) return;
        for (int k = 0; k < arity; ++k) step.v[points[k]] += step.points[points[k]].w * change * gradient[k];
    }

    // The rate of the residual: by the points' motion, and by that of what the function holds them to.
    double rate(const Substep& step, const Vectors& gradient) const
    {
        double sum = 0;
        if constexpr (requires { function.rate(); }) sum = function.rate();
        for (int k = 0; k < arity; ++k) sum += gradient[k].dot(step.v[points[k]]);
        return sum;
    }
    // Of the residual by an impulse, 1/kg.
    double inverse_mass(const Substep& step, const Vectors& gradient) const
    {
        double sum = 0;
        for (int k = 0; k < arity; ++k) sum += step.points[points[k]].w * gradient[k].squaredNorm();
        return sum;
    }

    // Whether a spring is too stiff for the sub-step to resolve: then it acts as a rod that gives way. W: inverse mass.
    bool is_stiff(double W, double dt) const { return compliance < W * dt * dt; }

    // A one-sided row begins with half of its last impulse on positions, and with all of it on velocities, as a force
    // that is the same throughout the sub-step.
    void warm_start(Substep& step)
    {
        Vectors P;
        for (int k = 0; k < arity; ++k) P[k] = step.start[points[k]];
        reference = compliance > 0 ? 0 : std::min(0.0, function.residual(P, direction));
        softness = compliance / (step.dt * step.dt);
        residual(step, direction);
        added = 0.5 * impulse;  // what the velocities get with the positions (Projection::advance)
        for (int k = 0; k < arity; ++k) {
            ProjectedPoint& point = step.points[points[k]];
            point.P += point.w * step.dt * added * direction[k];
            step.v[points[k]] += point.w * (impulse - added) * direction[k];
        }
    }

    // Keeps C at the reference, or above it. A residual that was there before is not made worse, and gives no speed.
    void project(Substep& step)
    {
        const Vectors P = positions(step);
        Vectors gradient;
        const double C = function.residual(P, gradient) - reference;
        if (!Traits::one_sided) direction = gradient;
        double along = 0;
        for (int k = 0; k < arity; ++k) along += step.points[points[k]].w * gradient[k].dot(direction[k]);
        if (!(along + softness > 0)) return;
        // What its direction has turned away from needs a larger impulse along it, up to any size: never above twice.
        const double stiffness = softness + std::max(along, 0.5 * inverse_mass(step, gradient));
        const double total = Traits::one_sided ? impulse : added;
        double change = (-C / step.dt - softness * total) / stiffness;
        if (Traits::one_sided) change = std::max(change, -added);
        take(change);
        for (int k = 0; k < arity; ++k) {
            ProjectedPoint& point = step.points[points[k]];
            const Vec3d shift = point.w * change * direction[k];
            point.P += step.dt * shift;
            if (is_resolved) step.v[points[k]] += shift;
        }
    }
    // Counts an impulse that moves positions.
    void take(double change)
    {
        added += change;
        impulse += !Traits::one_sided && compliance > 0 ? 2 * change : change;
    }

    // Takes off the velocity that is left along a rigid row.
    void solve_velocity(Substep& step)
    {
        Vectors gradient;
        const double C = residual(step, gradient), W = inverse_mass(step, gradient);
        if (!(W > 0) || !is_stiff(W, step.dt)) return;
        double change = -rate(step, gradient) / W;
        if (Traits::one_sided) {
            if (!(impulse > 0 || C < 0)) return;
            change = std::max(change, -impulse);
        }
        impulse += change;
        for (int k = 0; k < arity; ++k) step.v[points[k]] += step.points[points[k]].w * change * gradient[k];
    }

    // Moves the points to where C = 0, which gives no velocity.
    void correct_position(Substep& step) const
    {
        if (compliance > 0) return;
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

    // How far it is off, m, where C is `residual`: a spring from what its own force has come to.
    double error(double residual, double dt) const
    {
        if (Traits::one_sided) return std::min(residual + compliance * impulse / dt, 0.0);
        return compliance > 0 ? residual - reference + softness * dt * added : residual;
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

// The gradient along which a force that is the same throughout a sub-step does the work F (C(to) - C(from)), and turns
// nothing (Gonzalez 1996): of a distance |d| it is (d + d')/(|d| + |d'|). Of functions that do not give it, the
// gradient in the middle, which is so to second order.
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
