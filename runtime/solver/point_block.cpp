#include "runtime/solver/point_block.h"

#include "runtime/solver/motion/quadratic_drag.h"

namespace rapid {

void PointBlock::begin(std::span<const std::uint32_t> block_indices, std::span<const Vec3f> P0,
                       std::span<const Vec3f> v0, const OwnTime& time, int count)
{
    indices = block_indices;
    substeps = count;
    const std::size_t n = indices.size();
    P.resize(n);
    v.resize(n);
    dt.resize(n);
    rounded.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        rounded[i] = P0[indices[i]];
        P[i] = rounded[i].cast<double>();
        v[i] = v0[indices[i]].cast<double>();
        dt[i] = time(indices[i]) / substeps;
    }
    moved_dt = dt;
}

void PointBlock::drift(std::span<const double> t)
{
    for (std::size_t i = 0; i < P.size(); ++i) {
        P[i] += t[i] * (v[i] + 0.5 * t[i] * a[i]);
        v[i] += t[i] * a[i];
    }
}

void PointBlock::find_damped_paths(std::span<const double> t)
{
    damped.resize(P.size());
    Responder responder;
    for (std::size_t i = 0; i < P.size(); ++i) damped[i] = Damped::from(P[i], v[i], a[i], linear[i], t[i], responder);
}

void PointBlock::drift_damped(std::span<const double> t)
{
    if (!has_springs() && (linear.stride || linear[0].c > 0)) return drift_dragged(t);
    Responder responder;
    for (std::size_t i = 0; i < P.size(); ++i) {
        const Vec3d G = acceleration_at_rest(P[i], a[i], linear[i]);
        const Propagator r = respond(v[i], G, linear[i], t[i], responder).by;
        P[i] += v[i] * r.x_of_v + G * r.x_of_G;
        v[i] = v[i] * r.v_of_v + G * r.v_of_G;
    }
}

// The same without springs: computes the exponentials of all points at once, except for those with quadratic drag.
void PointBlock::drift_dragged(std::span<const double> t)
{
    const std::size_t n = P.size();
    rates_.resize(n);
    for (std::size_t i = 0; i < n; ++i) rates_[i] = linear[i].k;
    dragged_.respond(rates_, t);
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3d G = acceleration_at_rest(P[i], a[i], linear[i]);
        Propagator r{dragged_.x_of_v[i], dragged_.x_of_G[i], dragged_.v_of_v[i], dragged_.x_of_v[i]};
        if (linear[i].c > 0) r = respond_to_quadratic_drag(v[i], G, linear[i].k, linear[i].c, t[i]).by;
        P[i] += v[i] * r.x_of_v + G * r.x_of_G;
        v[i] = v[i] * r.v_of_v + G * r.v_of_G;
    }
}

bool PointBlock::has_springs() const
{
    for (std::size_t i = 0; i < (linear.stride ? P.size() : 1); ++i)
        if (linear[i].w2 > 0) return true;
    return false;
}

}  // namespace rapid
