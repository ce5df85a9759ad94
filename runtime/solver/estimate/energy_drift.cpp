#include "runtime/solver/estimate/energy_drift.h"

#include <algorithm>
#include <cmath>

#include "runtime/points/members.h"
#include "runtime/solver/step_context.h"

namespace rapid {
namespace {

// Returns kinetic plus potential energies, J/kg; nothing if there is no potential.
std::optional<std::vector<double>> energies_of(const PointSet& points, const Dynamics& dynamics)
{
    std::vector<Vec3d> P(points.size()), v(points.size());
    const Strided<Vec3f> P_of_points = points.P().read(), v_of_points = points.v().read();
    for (std::size_t i = 0; i < points.size(); ++i) {
        P[i] = P_of_points[i].cast<double>();
        v[i] = v_of_points[i].cast<double>();
    }
    const std::vector<double> zeros(points.size());
    const Chunk chunk{points, 0, P, v, zeros, zeros, 0};
    std::vector<double> energies(points.size()), potential;
    for (std::size_t i = 0; i < points.size(); ++i) energies[i] = 0.5 * v[i].squaredNorm();
    for (const std::shared_ptr<const Force>& force : dynamics.forces()) {
        potential.assign(points.size(), 0);
        if (!force->add_potential(chunk, potential)) return std::nullopt;
        const Strided<std::uint8_t> members = members_of(points, force->group);
        for (std::size_t i = 0; i < points.size(); ++i)
            if (members[i]) energies[i] += potential[i];
    }
    return energies;
}

// Returns true if velocities also change in other ways than by the slope of a potential.
bool spend_energy(const Dynamics& dynamics)
{
    return !dynamics.actions().empty() || !dynamics.constraints().empty() || !dynamics.interactions().empty();
}

}  // namespace

void EnergyDrift::begin(const PointSet& points, const Shadows& shadows, const Dynamics& dynamics, SolveOptions& options)
{
    before_.clear();
    indices_.clear();
    collides_ = false;
    defined_ = !nonzero_forces_of(points) && !spend_energy(dynamics);
    if (!defined_) return;
    if (!shadows.idle()) indices_.assign(shadows.indices().begin(), shadows.indices().end());
    auto energies = energies_of(shadows.idle() ? points.select({}) : shadows.before(), dynamics);
    defined_ = energies.has_value();
    if (!defined_ || shadows.idle()) return;

    before_ = std::move(*energies);
    std::vector<double> drift(before_.size(), 0);
    for (std::size_t k = 0, old = 0; k < drift.size() && old < ids_.size();) {
        if (ids_[old] == shadows.ids()[k]) drift[k] = drift_[old];
        if (ids_[old] <= shadows.ids()[k])
            ++old;
        else
            ++k;
    }
    drift_ = std::move(drift);
    ids_.assign(shadows.ids().begin(), shadows.ids().end());
    if (dynamics.colliders().empty()) return;
    // Other entries are not read.
    met_.resize(points.size());
    for (const std::uint32_t i : indices_) met_[i] = 0;
    options.sinks.met = met_.data();
    collides_ = true;
}

std::optional<std::vector<double>> EnergyDrift::end(const PointSet& solved, const Shadows& shadows,
                                                    const Dynamics& dynamics)
{
    if (!defined_) {
        drift_.assign(drift_.size(), 0);
        return std::nullopt;
    }
    if (shadows.idle()) return std::vector<double>(solved.empty() ? 0 : 1, 0.0);  // solved in closed form
    if (collides_)                                                                // far apart in memory
        for (const std::uint32_t i : indices_) __builtin_prefetch(&met_[i]);
    const auto after = energies_of(solved.select(shadows.indices()), dynamics);
    if (!after) return std::nullopt;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < ids_.size() && kept < shadows.ids().size(); ++k) {
        if (ids_[k] != shadows.ids()[kept]) continue;  // the point has died
        const double change = (*after)[kept] - before_[k];
        const bool counts = std::isfinite(change) && !(collides_ && met_[indices_[k]]);
        ids_[kept] = ids_[k];
        drift_[kept++] = drift_[k] + (counts ? change : 0);
    }
    ids_.resize(kept);
    drift_.resize(kept);
    return drift_;
}

}  // namespace rapid
