#include "runtime/solver/interaction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "runtime/base/memory_budget.h"
#include "runtime/base/parallel.h"
#include "runtime/math/random.h"
#include "runtime/points/members.h"
#include "runtime/points/neighbours.h"
#include "runtime/solver/forces.h"

namespace rapid {
namespace {

// Limit of pairwise evaluations in a frame, 20 ns each: five hours of one processor.
constexpr double max_looks = 1e12;

// Returns (1 - e^(-2 k t)) / 2: the part of the velocity difference of two points that each gets in the time t if it
// decays at the rate k on both sides. At most a half, which makes them equal.
double exchanged(double k, double t) { return -0.5 * std::expm1(-2 * k * t); }

class Neighbourhood {
public:
    // kicks: number of later calls to kicks().
    Neighbourhood(const Interaction& interaction, const PointSet& points, const SolveOptions& options,
                  const InteractingPoints& at, int kicks)
        : interaction_(interaction),
          h_(options.h),
          steps_(at.steps),
          P_(at.P),
          v_(at.v),
          id_(points.id().read()),
          separation_(interaction.separation.read(points)),
          cohesion_(interaction.cohesion.read(points)),
          alignment_(interaction.alignment.read(points)),
          drag_(interaction.drag.read(points)),
          avoidance_(interaction.avoidance.read(points)),
          avoids_(!interaction.avoidance.attribute.empty() || interaction.avoidance.constant > 0)
    {
        if (const auto* masses = points.find<float>("mass")) mass_ = masses->read();
        if (const auto* own = points.find<float>("dt")) own_dt_ = own->read();

        const Strided<std::uint8_t> members = members_of(points, interaction.group);
        const auto takes_part = [&](std::size_t i) { return members[i] && (at.dead.empty() || !at.dead[i]); };
        std::size_t count = 0;
        for (std::size_t i = 0; i < points.size(); ++i) count += takes_part(i);
        require_memory(count);
        std::vector<Vec3f> positions;
        positions.reserve(count);
        members_.reserve(count);
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (!takes_part(i)) continue;
            if (!P_[i].allFinite() || !v_[i].allFinite()) {  // the solver reports it, with the point's name
                members_.clear();
                return;
            }
            if (!std::isfinite(mass_[i]))
                throw Error(fmt::format("point {}, frame {}: its mass is {:g}; with interactions it must be finite",
                                        id_[i], options.frame, mass_[i]));
            members_.push_back(static_cast<std::uint32_t>(i));
            positions.push_back(P_[i].template cast<float>());
        }
        if (members_.empty()) return;
        grid_.emplace(positions, interaction.radius);
        require_affordable(at.steps, kicks);
        if (!interaction.sees_all())
            for (const std::uint32_t i : members_) headings_.push_back(v_[i]);
        weights_.assign(members_.size(), 0);
        for_all([&](std::size_t m, std::size_t other) { weights_[m] += weight_at(distance(m, other)); });
    }

    // Returns the velocity change of each member, m/s.
    std::vector<Vec3d> kicks() const
    {
        std::vector<Vec3d> kicks(members_.size(), Vec3d::Zero());
        if (members_.empty()) return kicks;
        for_all([&](std::size_t m, std::size_t other) { kicks[m] += kick(m, other); });
        return kicks;
    }

    std::span<const std::uint32_t> members() const { return members_; }

private:
    // Checks memory for points each in a separate cell.
    static void require_memory(std::size_t points)
    {
        constexpr double bytes_per_point = 160;  // measured: positions, cells, weights, headings, kicks
        const double bytes = bytes_per_point * static_cast<double>(points);
        if (!fits_in_memory(bytes))
            throw memory_exceeded(fmt::format("the neighbourhoods of {} points", points), bytes,
                                  "apply it to fewer points");
    }

    // The cost of a radius that contains all points grows with the square of their number, and may be endless. If it
    // could be too large, it is estimated from the neighbours of a few members.
    void require_affordable(double steps, int kicks) const
    {
        constexpr std::size_t sampled = 32;
        const double n = static_cast<double>(members_.size());
        const double passes = 2 * steps * (1 + kicks);  // at both ends of a step, with that over the weights
        if (n * n * passes <= max_looks) return;
        std::vector<std::uint32_t> near;
        double found = 0;
        for (std::size_t k = 0; k < sampled; ++k) {
            grid_->find(P_[members_[k * members_.size() / sampled]], near);
            found += static_cast<double>(near.size());
        }
        if (const double neighbours = found / sampled; n * neighbours * passes > max_looks)
            throw Error(fmt::format(
                "radius = {:g} m gives about {:.2g} neighbours for each of {} points, {:.2g} pairs in a frame of {:g} "
                "steps; at most {:g} are possible; give a smaller radius",
                interaction_.radius, neighbours, members_.size(), n * neighbours * passes, steps, max_looks));
    }

    // Calls f for each member with each of its neighbours, in order of their indices in the set.
    template <class F>
    void for_all(const F& f) const
    {
        grid_->for_each([&](std::uint32_t m, std::vector<std::uint32_t>& near) {
            if (interaction_.is_selective()) select(m, near);
            for (const std::uint32_t other : near)
                if (other != m) f(m, other);
        });
    }

    // Keeps the neighbours that a member heeds, in order.
    void select(std::size_t m, std::vector<std::uint32_t>& near) const
    {
        std::erase_if(near, [&](std::uint32_t other) { return other == m || !sees(m, other); });
        const auto most = static_cast<std::size_t>(interaction_.most);
        if (most == 0 || near.size() <= most) return;
        const auto nearer = [&](std::uint32_t a, std::uint32_t b) {
            const double to_a = between(m, a).squaredNorm(), to_b = between(m, b).squaredNorm();
            return to_a < to_b || (to_a == to_b && a < b);
        };
        std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(most), near.end(), nearer);
        near.resize(most);
        std::sort(near.begin(), near.end());
    }
    // Uses the initial direction of motion throughout all kicks.
    bool sees(std::size_t m, std::size_t other) const
    {
        if (headings_.empty()) return true;
        const Vec3d d = between(m, other), &heading = headings_[m];
        return d.dot(heading) >= cos_view_ * d.norm() * heading.norm();
    }

    Vec3d between(std::size_t m, std::size_t other) const { return P_[members_[other]] - P_[members_[m]]; }
    double distance(std::size_t m, std::size_t other) const { return between(m, other).norm(); }
    double weight_at(double d) const { return std::max(0.0, 1 - d / interaction_.radius); }
    double time(std::size_t i) const
    {
        if (!own_dt_.data || own_dt_[i] == static_cast<float>(h_)) return h_ / steps_;
        return own_dt_[i] / steps_;
    }

    // Bitwise symmetric in the two points, except for the sign.
    Vec3d kick(std::size_t m, std::size_t other) const
    {
        const std::size_t i = members_[m], j = members_[other];
        const auto mean = [&](const Strided<float>& strength) { return 0.5 * (double(strength[i]) + strength[j]); };
        const double step = std::min(time(i), time(j)), t = 0.5 * step;
        const Vec3d d = between(m, other);
        const double length = d.norm(), w = weight_at(length);
        const Vec3d n = length > 0 ? Vec3d(d / length) : direction(id_[i], id_[j]);

        // Limits an acceleration with at most this slope so that it moves the two points towards its zero in a step,
        // and never past it: one Newton step of the implicit solution. The 4: the weights of a neighbourhood average
        // to a quarter of its number, by which the slopes are not divided.
        const auto held = [&](double a, double slope) { return a / (1 + 4 * slope * t * step); };
        const double push = held(mean(separation_) * w, mean(separation_) / interaction_.radius);
        const double draw = held(mean(cohesion_) * 4 * w * (1 - w), 4 * mean(cohesion_) / interaction_.radius);

        const Vec3d u = v_[j] - v_[i];
        const double align = exchanged(mean(alignment_), t);
        const double along = exchanged(mean(alignment_) + mean(drag_), t);
        const Vec3d along_n = n * n.dot(u);

        const double share = 1 / std::max({1.0, weights_[m], interaction_.is_selective() ? 0.0 : weights_[other]});
        const double part = 2.0 * mass_[j] / (double(mass_[i]) + mass_[j]);
        Vec3d change = t * (draw - push) * n + w * (align * u + (along - align) * along_n);
        if (avoids_) change += t * mean(avoidance_) * aside(d, u, id_[i], id_[j]);
        return part * share * change;
    }

    // Returns the direction of avoidance, away from the other's position at the nearest approach, scaled by the urgency
    // from 0 to 1. On a collision course it points to an arbitrary side.
    Vec3d aside(const Vec3d& d, const Vec3d& u, std::int64_t i, std::int64_t j) const
    {
        const double closing = -d.dot(u);
        if (!(closing > 0)) return Vec3d::Zero();
        const double time = std::min(closing / u.squaredNorm(), interaction_.foresight);
        Vec3d e = d + time * u;
        const double passes = e.norm();
        if (passes >= interaction_.clearance) return Vec3d::Zero();
        const double urgency = (1 - passes / interaction_.clearance) * (1 - time / interaction_.foresight);
        if (!(passes > 1e-9 * interaction_.clearance)) {
            const Vec3d any = direction(i, j);
            e = any - any.dot(u) / u.squaredNorm() * u;
        }
        return -urgency * e.stableNormalized();
    }

    // Coincident points get an arbitrary direction, opposite for the two points of the pair.
    static Vec3d direction(std::int64_t a, std::int64_t b)
    {
        const auto u = uniform4(RandomKey(0, "interact"), static_cast<std::uint64_t>(std::min(a, b)),
                                static_cast<std::uint64_t>(std::max(a, b)));
        const double z = 2 * u[0] - 1, around = 2 * EIGEN_PI * u[1], r = std::sqrt(1 - z * z);
        const Vec3d n(r * std::cos(around), r * std::sin(around), z);
        return a < b ? n : Vec3d(-n);
    }

    const Interaction& interaction_;
    double h_, steps_;
    std::span<const Vec3d> P_, v_;
    Strided<std::int64_t> id_;
    Strided<float> separation_, cohesion_, alignment_, drag_, avoidance_;
    bool avoids_;
    Strided<float> mass_{&unit_mass, 0}, own_dt_{nullptr, 0};
    std::vector<std::uint32_t> members_;  // indices in the set
    std::optional<Neighbours> grid_;      // of the members
    std::vector<double> weights_;         // Σ w, by member
    double cos_view_ = std::cos(0.5 * interaction_.view);
    std::vector<Vec3d> headings_;  // initial velocities; empty if all see in every direction
};

}  // namespace

void interact(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options,
              const InteractingPoints& at, int kicks)
{
    const Strided<std::uint8_t> advanced = members_of(points, options.group);
    for (const std::shared_ptr<const Interaction>& interaction : dynamics.interactions())
        at_node(*interaction, [&] {
            const Neighbourhood neighbourhood(interaction->at(at.time), points, options, at, kicks);
            for (int kick = 0; kick < kicks; ++kick) {
                const std::vector<Vec3d> change = neighbourhood.kicks();
                for (std::size_t m = 0; m < change.size(); ++m) {
                    const std::size_t i = neighbourhood.members()[m];
                    if (advanced[i]) at.v[i] += change[m];
                }
            }
        });
}

void interact(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double time)
{
    if (points.empty() || dynamics.interactions().empty()) return;
    std::vector<Vec3d> P(points.size()), v(points.size());
    const std::span<Vec3f> rounded = points.v().write();
    const Strided<Vec3f> positions = std::as_const(points).P().read();
    for (const std::shared_ptr<const Interaction>& interaction : dynamics.interactions()) {
        for (std::size_t i = 0; i < P.size(); ++i) {
            P[i] = positions[i].cast<double>();
            v[i] = rounded[i].cast<double>();
        }
        Dynamics one;
        one.add(interaction);
        interact(points, one, options, {P, v, {}, time, 1}, 1);
        for (std::size_t i = 0; i < v.size(); ++i) rounded[i] = v[i].cast<float>();
    }
}

}  // namespace rapid
