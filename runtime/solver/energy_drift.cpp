#include "runtime/solver/energy_drift.h"

#include <algorithm>
#include <cmath>

#include "runtime/solver/interaction.h"

namespace rapid {
namespace {

// J/kg, of the points at these places; nothing where there is no such energy.
std::optional<std::vector<double>> energies_of(const PointSet& points, std::span<const std::uint32_t> places,
                                               std::span<const DynamicPtr> dynamics)
{
    const PointSet some = points.select(places);
    std::vector<Vec3d> P(some.size()), v(some.size());
    const Strided<Vec3f> P_of_some = some.P().read(), v_of_some = some.v().read();
    for (std::size_t i = 0; i < some.size(); ++i) {
        P[i] = P_of_some[i].cast<double>();
        v[i] = v_of_some[i].cast<double>();
    }
    const std::vector<double> none(some.size());
    const Chunk chunk{some, 0, P, v, none, none, 0};
    std::vector<double> energies(some.size()), potential;
    for (std::size_t i = 0; i < some.size(); ++i) energies[i] = 0.5 * v[i].squaredNorm();
    for (const DynamicPtr& dynamic : dynamics) {
        const auto* force = dynamic_cast<const Force*>(dynamic.get());
        if (!force) continue;
        potential.assign(some.size(), 0);
        if (!force->add_potential(chunk, potential)) return std::nullopt;
        const Column<std::uint8_t>* group = some.find_group(force->group);
        for (std::size_t i = 0; i < some.size(); ++i)
            if (force->group.empty() || (group && (*group)[i])) energies[i] += potential[i];
    }
    return energies;
}

// Those that change velocities by more than the slope of a potential.
bool spends_energy(const DynamicPtr& dynamic)
{
    return dynamic_cast<const Action*>(dynamic.get()) || dynamic_cast<const Constraint*>(dynamic.get()) ||
           dynamic_cast<const Interaction*>(dynamic.get());
}

}  // namespace

void EnergyDrift::begin(const PointSet& points, const Shadows& shadows, std::span<const DynamicPtr> dynamics,
                        SolveOptions& options)
{
    before_.clear();
    places_.clear();
    met_.clear();
    const auto* force = points.find<Vec3f>("force");
    const bool forced = force && !(force->is_uniform() && !points.empty() && (*force)[0].isZero());
    defined_ = !forced && std::none_of(dynamics.begin(), dynamics.end(), spends_energy);
    if (!defined_) return;
    if (!shadows.idle()) places_.assign(shadows.places().begin(), shadows.places().end());
    auto energies = energies_of(points, places_, dynamics);
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
    const auto is_collider = [](const DynamicPtr& dynamic) { return dynamic_cast<const Collider*>(dynamic.get()); };
    if (std::none_of(dynamics.begin(), dynamics.end(), is_collider)) return;
    met_.assign(points.size(), 0);
    options.met = met_.data();
}

std::optional<std::vector<double>> EnergyDrift::end(const PointSet& solved, const Shadows& shadows,
                                                    std::span<const DynamicPtr> dynamics)
{
    if (!defined_) {
        drift_.assign(drift_.size(), 0);
        return std::nullopt;
    }
    if (shadows.idle()) return std::vector<double>(solved.empty() ? 0 : 1, 0.0);  // in closed form
    const auto after = energies_of(solved, shadows.places(), dynamics);
    if (!after) return std::nullopt;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < ids_.size() && kept < shadows.ids().size(); ++k) {
        if (ids_[k] != shadows.ids()[kept]) continue;  // it has died
        const double change = (*after)[kept] - before_[k];
        const bool counts = std::isfinite(change) && !(!met_.empty() && met_[places_[k]]);
        ids_[kept] = ids_[k];
        drift_[kept++] = drift_[k] + (counts ? change : 0);
    }
    ids_.resize(kept);
    drift_.resize(kept);
    return drift_;
}

}  // namespace rapid
