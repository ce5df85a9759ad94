#include "runtime/solver/constraints/heavy_contacts.h"

#include <algorithm>
#include <limits>

#include "runtime/solver/constraints/impact.h"

namespace rapid {
namespace {

// Overlap above which a contact is corrected, relative to the smaller radius.
constexpr double too_deep = 0.05;

// An overlap is stuck if a substep leaves more than this fraction of it; four fifths should have been recovered.
constexpr double stuck = 0.9;

// Mass ratio above which the iterations do not suffice.
constexpr double uneven = 2;

void pass_on(Substep& step, std::uint32_t from, std::uint32_t to)
{
    if (step.support[from] <= step.next_support[to] + 1) return;
    step.next_support[to] = step.support[from] - 1;
    if (!step.support_v.empty()) step.next_support_v[to] = step.support_v[from];
}

}  // namespace

void HeavyContacts::begin(const Substep& step)
{
    double most = 0, least = std::numeric_limits<double>::infinity();
    for (const ProjectedPoint& at : step.points)
        if (at.w > 0) most = std::max(most, at.w), least = std::min(least, at.w);
    any_ = most > uneven * least;
}

void HeavyContacts::pass_on_support(const ContactPack& pack, Substep& step)
{
    for (std::uint32_t l = 0; l < pack.count; ++l) {
        if (!(pack.normal_impulse[l] > 0)) continue;
        const std::uint32_t i = pack.i[l], j = pack.j[l];
        pass_on(step, i, j);
        pass_on(step, j, i);
    }
}

// The lighter point is a wall if it is better supported, or if the heavy one wedges it against its support. The heavy
// point also loses its velocity into the lighter one: at most its own velocity relative to the lighter one's support,
// or the resting speed. A light point that is squeezed out or thrown thus gives it no more, and a shape that lifts both
// still takes away the speed due to weight.
void HeavyContacts::correct(const PairContact& contact, const ContactMaterial& material, Substep& step)
{
    const bool first = step.points[contact.i].w < step.points[contact.j].w;  // is the heavier
    const std::uint32_t heavy = first ? contact.i : contact.j, light = first ? contact.j : contact.i;
    if (!(step.points[heavy].w > 0) || step.support[light] == 0) return;
    const Vec3d d = step.points[heavy].P - step.points[light].P;
    const double distance = d.norm(), overlap = contact.reach - distance;
    const double allowed = too_deep * std::min(material.radius[contact.i], material.radius[contact.j]);
    const double depth = overlap - allowed;
    if (!(depth > 0) || !(distance > 0)) return;
    const bool wedged = -contact.initial_gap > allowed && overlap > stuck * -contact.initial_gap &&
                        step.points[light].w > uneven * step.points[heavy].w;
    if (step.support[light] <= step.support[heavy] && !wedged) return;
    const Vec3d n = d / distance;
    step.points[heavy].P += depth * n;
    const Vec3d support = step.support_v.empty() ? Vec3d(Vec3d::Zero()) : step.support_v[light];
    const double own = -n.dot(step.v[heavy] - support), closing = n.dot(step.v[light] - step.v[heavy]);
    step.v[heavy] += std::clamp(closing, 0.0, std::max(own, resting_speed(step))) * n;
}

}  // namespace rapid
