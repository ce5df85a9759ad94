#include "runtime/solver/collision/contact_audit.h"

#include <map>

namespace rapid {
namespace {

// Sums the displacements of each point.
std::map<std::uint32_t, Vec3d> by_point(std::span<const Ejection::Displacement> displacements)
{
    std::map<std::uint32_t, Vec3d> sums;
    for (const auto& [i, by] : displacements) sums.try_emplace(i, Vec3d::Zero()).first->second += by;
    return sums;
}

}  // namespace

void ContactAudit::add(std::size_t i, int obstacle, const Impact& impact)
{
    ++figures_.collisions;
    const std::optional<double>& record = block_.obstacles[obstacle].record;
    const bool records = record && impact.speed >= *record;
    if (!records && !block_.context.log) return;
    const std::uint32_t index = block_.indices[i];
    const double impulse = block_.context.mass[index] * impact.change.norm();
    if (records) block_.context.hits->record(index, obstacle, impact, impulse);
    if (block_.context.log)
        block_.context.log->add({index, obstacle, impact.time, impact.P.cast<float>(), impact.n.cast<float>(),
                                 impact.vc.cast<float>(), impact.v.cast<float>(),
                                 (impact.v + impact.change).cast<float>(), static_cast<float>(impact.speed),
                                 static_cast<float>(impulse), records});
}

// A free path conserves v²/2 - a·P, so any change of it is the work of contacts.
void ContactAudit::add_energy(const TouchedPoints& touched, const StuckPoints& stuck, const FreeMotion& motion)
{
    for (const std::uint32_t i : touched.list()) {
        const std::optional<double> mass = block_.moved_mass(i);
        if (stuck.has(i) || !mass) continue;
        const Vec3d P = motion.initial_P(i), v = motion.initial_v(i);
        const double change =
            0.5 * (block_.v[i] - v).dot(block_.v[i] + v) - motion.acceleration(i).dot(block_.P[i] - P);
        figures_.contact_energy.take(*mass * change);
    }
}

// A carrier supplies the point's gain in kinetic energy, and the work against its forces.
void ContactAudit::add_carried(const StuckPoints& stuck, const FreeMotion& motion)
{
    for (const StuckPoints::Carried& at : stuck.carried()) {
        const std::optional<double> mass = block_.moved_mass(at.i);
        if (!mass) continue;
        const double work = 0.5 * (at.to_v - at.v).dot(at.to_v + at.v) +
                            (motion.is_damped() ? motion.potential_change(at.i, at.P, at.to_P)
                                                : -motion.acceleration(at.i).dot(at.to_P - at.P));
        figures_.contact_energy.take(*mass * work);
        if (motion.is_damped()) all_work_[at.i] += work;
    }
}

void ContactAudit::begin_work()
{
    work_.assign(block_.size(), 0.0);
    if (all_work_.empty()) all_work_ = work_;
}

void ContactAudit::count_work(const TouchedPoints& touched)
{
    for (const std::uint32_t i : touched.list()) {
        const std::optional<double> mass = block_.moved_mass(i);
        if (work_[i] == 0 || !mass) continue;
        figures_.contact_energy.take(*mass * work_[i]);
        all_work_[i] += work_[i];
    }
}

void ContactAudit::add_displacements(std::span<const Ejection::Displacement> displacements, const FreeMotion& motion)
{
    for (const auto& [i, by] : by_point(displacements)) {
        const std::optional<double> mass = block_.moved_mass(i);
        if (mass)
            figures_.contact_energy.take(
                *mass * (motion.potential(i, motion.initial_P(i) + by) - motion.potential(i, motion.initial_P(i))));
    }
}

void ContactAudit::add_corrections(std::span<const Vec3d> P, std::span<const Vec3d> v, const FreeMotion& motion)
{
    for (std::size_t i = 0; i < P.size(); ++i) {
        if (P[i] == block_.P[i] && v[i] == block_.v[i]) continue;
        const double kinetic = 0.5 * (block_.v[i] - v[i]).dot(block_.v[i] + v[i]);
        work_[i] += kinetic + motion.potential(i, block_.P[i]) - motion.potential(i, P[i]);
    }
}

void ContactAudit::add_final_corrections(std::span<const Vec3d> P,
                                         std::span<const Ejection::Displacement> displacements,
                                         const FreeMotion& motion)
{
    for (const auto& [i, by] : by_point(displacements)) {
        const std::optional<double> mass = block_.moved_mass(i);
        if (!mass) continue;
        const double work = motion.is_damped() ? motion.potential(i, P[i]) - motion.potential(i, P[i] - by)
                                               : -motion.acceleration(i).dot(by);
        figures_.contact_energy.take(*mass * work);
    }
}

}  // namespace rapid
