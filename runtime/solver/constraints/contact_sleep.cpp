#include "runtime/solver/constraints/contact_sleep.h"

#include <algorithm>
#include <utility>

#include "runtime/solver/constraints/impact.h"

namespace rapid {
namespace {

// The change of a neighbour's impulse that wakes a sleeper, relative to its burden.
constexpr double disturbing = 0.1;

// The largest overlap at which two points may fall asleep, relative to the smaller radius.
constexpr double too_deep_to_sleep = 0.05;

// Returns the impulse on i, N s.
Vec3f impulse_of(const PairContact& contact, const PairImpulses& impulses)
{
    return impulses.normal[contact.pair] * contact.n.cast<float>() + impulses.tangential[contact.pair];
}

}  // namespace

bool ContactSleep::wake_by_impact(const ContactPacks& packs, const PairImpulses& impulses,
                                  const ContactMaterial& material, Substep& step)
{
    if (!any()) return false;
    const double at_rest = resting_speed(step);
    shock_.clear();
    packs.for_each([&](const PairContact& contact) {
        const auto [i, j] = std::pair(contact.i, contact.j);
        const bool first = asleep(i);
        if (first == asleep(j)) return;
        const double closing = -contact.n.dot(step.v[i] - step.v[j]);
        if (closing < at_rest || contact.n.dot(step.points[i].P - step.points[j].P) > contact.reach) return;
        if (shock_.empty()) shock_.assign(step.size(), 0);
        const std::uint32_t hit = first ? i : j, by = first ? j : i;
        shock_[hit] = std::max(shock_[hit], closing / step.points[by].w);
    });
    if (shock_.empty()) return false;
    const auto moves = [&](std::size_t i) { return shock_[i] * sleep_->inverse_mass(i) >= at_rest; };
    for (bool spreads = true; spreads;) {
        spreads = false;
        for (const auto& [i, j] : impulses.pairs) {
            for (const auto& [from, to] : {std::pair(i, j), std::pair(j, i)}) {
                if (!(0.5 * shock_[from] > shock_[to]) || !moves(from) || !asleep(to)) continue;
                const double reach = near_contact * material.reach(i, j);
                if ((step.points[i].P - step.points[j].P).squaredNorm() > reach * reach) continue;
                shock_[to] = 0.5 * shock_[from];
                spreads |= moves(to);
            }
        }
    }
    bool woken = false;
    for (std::size_t i = 0; i < step.size(); ++i) {
        if (!asleep(i) || !moves(i)) continue;
        woken = true;
        sleep_->wake_now(i, step);
    }
    sleep_->wake_islands_now(step);
    return woken;
}

void ContactSleep::wake_by_load(const PairContact& contact, const PairImpulses& impulses, const Substep& step) const
{
    const bool first = asleep(contact.i);
    if (first == asleep(contact.j)) return;
    const std::uint32_t sleeper = first ? contact.i : contact.j;
    Vec3f change = impulse_of(contact, impulses);
    if (!impulses.resting.empty()) change -= impulses.resting[contact.pair];
    if (change.norm() > disturbing * step.dt * sleep_->burden(sleeper)) sleep_->wake(sleeper);
}

void ContactSleep::report(const ContactPacks& packs, PairImpulses& impulses, const ContactMaterial& material,
                          const Substep& step) const
{
    if (impulses.resting.empty()) impulses.resting.assign(impulses.pairs.size(), Vec3f::Zero());
    const double per_dt = 1 / step.dt;
    std::vector<std::uint8_t> deep;
    packs.for_each([&](const PairContact& contact) {
        const auto [i, j] = std::pair(contact.i, contact.j);
        if (both_asleep(i, j)) return;
        const double overlap = contact.reach - (step.points[i].P - step.points[j].P).norm();
        const Vec3f impulse = impulse_of(contact, impulses);
        for (const std::uint32_t k : {i, j}) sleep_->add_load(k, impulse.norm() * per_dt);
        if (overlap > too_deep_to_sleep * std::min(material.radius[i], material.radius[j])) {
            deep.resize(step.size());
            deep[i] = deep[j] = 1;
        }
        if (!asleep(i) && !asleep(j)) impulses.resting[contact.pair] = impulse;
    });
    if (deep.empty()) return;
    packs.for_each([&](const PairContact& contact) {
        if (!deep[contact.i] && !deep[contact.j]) return;
        for (const std::uint32_t i : {contact.i, contact.j}) sleep_->keep_awake(i);
    });
}

}  // namespace rapid
