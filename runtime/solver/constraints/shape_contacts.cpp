#include "runtime/solver/constraints/shape_contacts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "runtime/base/parallel.h"
#include "runtime/base/per_thread.h"
#include "runtime/points/id_index.h"
#include "runtime/solver/constraints/contact_forces.h"
#include "runtime/solver/constraints/impact.h"
#include "runtime/solver/constraints/sleep.h"
#include "runtime/solver/constraints/spin.h"

namespace rapid {
namespace {

// The largest change of a normal that does not wake: a slope of 0.06 degrees.
constexpr float same_normal = 1e-3f;

// One step of FNV-1a.
std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) { return (hash ^ value) * 0x100000001b3u; }

}  // namespace

bool ShapeGrip::is_like(const ShapeGrip& other) const
{
    return hash == other.hash && (normal - other.normal).norm() <= same_normal;
}

std::vector<ShapeGrip> shape_grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                                   std::span<const Vec3d> P, double time)
{
    std::vector<ShapeGrip> result(points.size());
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> queried;
        std::vector<Vec3d> at, gradient;
        std::vector<double> phi, times, reach;
        for (std::size_t o = 0; o < obstacles.size(); ++o) {
            const Obstacle& obstacle = obstacles[o];
            queried.clear();
            at.clear();
            reach.clear();
            for (std::size_t k = begin; k < end; ++k) {
                const std::uint32_t i = points[k];
                const double radius = obstacle.radius[i];
                const double near = radius + std::max(touch * radius, obstacle.contact_tolerance(P[i], radius));
                if (!obstacle.members[i] || obstacle.bounds.squaredExteriorDistance(P[i]) > near * near) continue;
                queried.push_back(static_cast<std::uint32_t>(k));
                at.push_back(P[i]);
                reach.push_back(near);
            }
            if (queried.empty()) continue;
            phi.resize(at.size());
            gradient.resize(at.size());
            times.assign(at.size(), time);
            obstacle.shape->distance_at(at, times, phi, gradient);
            for (std::size_t k = 0; k < queried.size(); ++k) {
                if (phi[k] > reach[k]) continue;
                const std::uint32_t i = points[queried[k]];
                const bool sunk = phi[k] < 2 * obstacle.radius[i] - reach[k];
                ShapeGrip& grip = result[queried[k]];
                grip.normal += gradient[k].normalized().cast<float>();
                for (const std::uint64_t value :
                     {std::uint64_t(o + 1), std::uint64_t(std::bit_cast<std::uint32_t>(obstacle.friction[i])),
                      std::uint64_t(std::bit_cast<std::uint32_t>(obstacle.bounce[i])),
                      static_cast<std::uint64_t>(obstacle.response), std::uint64_t(sunk)})
                    grip.hash = mixed(grip.hash, value);
            }
        }
    });
    return result;
}

namespace {

// How far a point may be pushed within a substep and still be kept out of a shape that it was not near: this fraction
// of its radius plus its own motion. A point pushed farther is found inside in the next substep.
constexpr double push = 0.5;

}  // namespace

float push_radius(std::span<const float> sizes, const Obstacle& obstacle, std::size_t i)
{
    return sizes.empty() ? obstacle.radius[i] : std::max(obstacle.radius[i], sizes[i]);
}

double ShapeQuery::reach(const Obstacle& obstacle, std::size_t i) const
{
    return push * push_radius(sizes, obstacle, i) + moved[i - begin];
}

ShapeClearance::ShapeClearance(std::span<const Obstacle> obstacles, std::size_t size)
    : obstacles_(obstacles),
      size_(size),
      any_moves_(std::any_of(obstacles.begin(), obstacles.end(), [](const Obstacle& o) { return o.moves; })),
      clearance_(obstacles.size() * size, -1.0f),
      room_(size, -1.0f)
{
}

void ShapeClearance::begin(std::span<const Vec3d> free)
{
    if (query_positions_.empty()) query_positions_.assign(free.begin(), free.end());
}

// Branchless, because most points are known to be far from all shapes, or close to one for a long time.
void ShapeClearance::open(ShapeQuery& query, const Substep& step, std::size_t end)
{
    const std::span<const Vec3d> free = query.free;
    std::vector<std::uint32_t>& open = query.open;
    open.resize(end - query.begin + 1);
    std::size_t count = 0;
    for (std::size_t i = query.begin; i < end; ++i) {
        // An upper bound of (|moved| + |moved since the last query|)².
        const double moved2 =
            2 * ((free[i] - step.start[i]).squaredNorm() + (free[i] - query_positions_[i]).squaredNorm());
        open[count] = static_cast<std::uint32_t>(i);
        count += any_moves_ | !(room_[i] > 0 && double(room_[i]) * double(room_[i]) > moved2);
    }
    open.resize(count);
    query.moved.resize(end - query.begin);
    query.since_query.resize(end - query.begin);
    for (const std::uint32_t i : open) {
        query.moved[i - query.begin] = (free[i] - step.start[i]).norm();
        query.since_query[i - query.begin] = (free[i] - query_positions_[i]).norm();
        room_[i] = std::numeric_limits<float>::infinity();
    }
}

void ShapeClearance::query(ShapeQuery& query, std::size_t obstacle, const Substep& step)
{
    list(query, obstacle, step);
    query.phi.resize(query.P.size());
    query.gradient.resize(query.P.size());
    query.time.assign(query.P.size(), query.since);
    if (query.queried.empty()) return;
    obstacles_[obstacle].shape->distance_at(query.P, query.time, query.phi, query.gradient);
    // Subtracts the point's displacement from query_positions_, because the distance was measured at its current
    // position.
    for (std::size_t k = 0; k < query.queried.size(); ++k) {
        const std::uint32_t i = query.queried[k];
        const double gap = query.phi[k] - obstacles_[obstacle].radius[i];
        clearance_[obstacle * size_ + i] = static_cast<float>(gap - query.since_query[i - query.begin]);
    }
}

// Lists the points that no bound keeps away from the shape.
void ShapeClearance::list(ShapeQuery& query, std::size_t o, const Substep& step)
{
    const Obstacle& obstacle = obstacles_[o];
    float* clearance = clearance_.data() + o * size_;
    std::vector<std::uint32_t>& queried = query.queried;
    queried.resize(query.open.size() + 1);
    std::size_t near = 0;
    for (const std::uint32_t i : query.open) {
        queried[near] = i;
        near += obstacle.moves | (clearance[i] < query.since_query[i - query.begin] + query.reach(obstacle, i));
    }
    queried.resize(near);
    query.P.clear();
    std::erase_if(queried, [&](std::uint32_t i) {
        if (!(step.points[i].w > 0) || !obstacle.members[i] || !step.lives(i)) return true;
        const Vec3d& P = query.free[i];
        const double off =
            (P - obstacle.bounds.max()).cwiseMax(obstacle.bounds.min() - P).maxCoeff() - obstacle.radius[i];
        if (off > query.reach(obstacle, i)) {
            clearance[i] = static_cast<float>(off - query.since_query[i - query.begin]);
            return true;
        }
        query.P.push_back(P);
        return false;
    });
}

void ShapeClearance::close(const ShapeQuery& query, std::size_t o)
{
    const Obstacle& obstacle = obstacles_[o];
    const float* clearance = clearance_.data() + o * size_;
    for (const std::uint32_t i : query.open)
        if (obstacle.members[i])
            room_[i] =
                std::min(room_[i], clearance[i] - static_cast<float>(push) * push_radius(query.sizes, obstacle, i));
}

namespace {

// Distance, in radii, below which a point lies on a shape.
constexpr double flush = 0.01;

// Points processed together.
constexpr std::size_t points_per_chunk = 2048;

bool turns(const Substep& step, std::uint32_t i) { return !step.spins.empty() && step.spins[i].k > 0; }

// Returns the angular velocity of the body at a position, rad/s: half the curl of its velocity, which is taken as
// linear over the size of the point.
Vec3d turning_of(const Obstacle& obstacle, const Vec3d& P, double length, double time)
{
    Vec3d along[3];
    for (int k = 0; k < 3; ++k) {
        const Vec3d d = 0.5 * length * Vec3d::Unit(k);
        along[k] = (obstacle.shape->velocity_at(P + d, time) - obstacle.shape->velocity_at(P - d, time)) / length;
    }
    return 0.5 * Vec3d(along[1].z() - along[2].y(), along[2].x() - along[0].z(), along[0].y() - along[1].x());
}

// Returns the displacement by a constant force throughout the substep, per velocity that it would give a free point, s:
// dt/2 or, on a spring to a surface, (1 - cos Ω dt) / (Ω² dt). A spring that turns the point by many radians in the
// substep would store more energy in the displacement of a free point than friction takes.
double time_of_force(const Substep& step, std::uint32_t i)
{
    const double w2 = step.surface_springs.empty() ? 0 : step.surface_springs[i].w2;
    if (!(w2 > 0)) return 0.5 * step.dt;
    const double half = std::sin(0.5 * std::sqrt(w2) * step.dt);
    return 2 * half * half / (w2 * step.dt);
}

double friction_of(const Obstacle& obstacle, std::uint32_t i)
{
    return obstacle.response == Response::Stick ? std::numeric_limits<double>::max() : double(obstacle.friction[i]);
}

}  // namespace

ShapeContacts::ShapeContacts(std::span<const Obstacle> obstacles, std::size_t size, std::vector<float> sizes,
                             const Sleep* sleep)
    : obstacles_(obstacles),
      size_(size),
      sleep_(sleep),
      clearance_(obstacles, size),
      sizes_(std::move(sizes)),
      contacts_((size + points_per_chunk - 1) / points_per_chunk),
      before_(contacts_.size())
{
}

void ShapeContacts::recall(const ShapeLoads& loads, const Column<std::int64_t>& ids, double dt)
{
    const IdIndex index(ids);
    for (const ShapeLoads::Load& load : loads.loads) {
        const std::uint32_t i = index[load.id];
        if (i == IdIndex::none || load.obstacle >= obstacles_.size()) continue;
        ShapeContact contact{};
        contact.i = i;
        contact.obstacle = load.obstacle;
        contact.normal_impulse = contact.carried_impulse = 0.5 * dt * load.normal;
        contact.tangential_impulse = dt * load.tangent.cast<double>();
        contact.rolling_impulse = dt * load.rolling.cast<double>();
        contacts_[i / points_per_chunk].push_back(contact);
    }
    for (Batch& contacts : contacts_) std::sort(contacts.begin(), contacts.end(), is_before);
}

void ShapeContacts::remember(ShapeLoads& loads, const Column<std::int64_t>& ids, const Substep& step) const
{
    const double dt = step.dt;
    loads.loads.clear();
    for (const Batch& contacts : contacts_)
        for (const ShapeContact& contact : contacts) {
            const double normal = contact.normal_impulse + contact.carried_impulse;
            if (normal > 0 || (turns(step, contact.i) && contact.free_impulse > 0))
                loads.loads.push_back({ids[contact.i], contact.obstacle, static_cast<float>(normal / dt),
                                       (contact.tangential_impulse / dt).cast<float>(),
                                       (contact.rolling_impulse / dt).cast<float>()});
        }
}

void ShapeContacts::detect(const Substep& step, std::span<const Vec3d> free)
{
    clearance_.begin(free);
    std::swap(contacts_, before_);
    const auto find_in_chunk = [&](std::size_t begin, std::size_t end) {
        find(contacts_[begin / points_per_chunk], before_[begin / points_per_chunk], step, free, begin, end);
    };
    for_each_chunk(size_, find_in_chunk, points_per_chunk);
}

void ShapeContacts::solve_impacts(Substep& step, std::uint32_t sweep)
{
    tbb::parallel_for(std::size_t{0}, contacts_.size(), [&](std::size_t c) {
        for (const ShapeContact& contact : contacts_[c]) {
            const FreePath& path = step.paths[contact.i];
            if (path.sweep > 0 && path.sweep + 1 >= sweep) solve_impact(contact, step, sweep);
        }
    });
}

// Moves a point that another has hit back along the normal, to the position at which it met the shape.
void ShapeContacts::solve_impact(const ShapeContact& contact, Substep& step, std::uint32_t sweep) const
{
    const std::uint32_t i = contact.i;
    const FreePath& path = step.paths[i];
    const double C = contact.n.dot(step.points[i].P) - contact.level, pull = contact.n.dot(path.acceleration);
    if (!(step.points[i].w > 0) || !(C < 0)) return;
    Vec3d u = step.v[i] - contact.vc;
    const double speed = contact.n.dot(u);
    double since = 0;
    for (int k = 0; k < path_iterations; ++k) {
        const double mean = speed - 0.5 * since * pull;
        if (!(mean < 0)) return;
        since = std::min(C / mean, path.since);
    }
    u -= since * path.acceleration;
    if (!(u.dot(contact.n) < -resting_speed(step))) return;
    const double w = impact_inverse_mass(step, i), restitution = obstacles_[contact.obstacle].restitution(i);
    const Vec3d impulse = turns(step, i)
                              ? spinning_impact(step.spins[i], w, contact.n, u, restitution, contact.friction)
                              : impact_impulse(contact.n, u, 1 / w, restitution, contact.friction);
    if (step.forces) {
        const Vec3d friction = impulse - contact.n.dot(impulse) * contact.n;
        step.forces->add(i, contact.n, impulse);
        step.forces->add_work(i, friction.dot(u + 0.5 * w * friction), impulse.dot(contact.vc));
    }
    take_impulse(step, i, impulse, since, sweep);
}

void ShapeContacts::warm_start(Substep& step)
{
    if (!step.reaction.empty()) share_reactions(step);
    const auto start_chunk = [&](std::size_t begin, std::size_t) {
        for (ShapeContact& contact : contacts_[begin / points_per_chunk]) {
            if (!step.paths.empty()) skip_separating(contact, step);
            const double w = step.points[contact.i].w;
            if (!(w > 0)) continue;
            const bool spinning = turns(step, contact.i);
            if (spinning) start_spinning(contact, step);
            if (!(contact.normal_impulse > 0) && !(spinning && contact.free_impulse > 0)) continue;
            const Vec3d half =
                0.5 * ((contact.normal_impulse + contact.carried_impulse) * contact.n + contact.tangential_impulse);
            step.points[contact.i].P += w * step.dt * half;
            step.v[contact.i] += w * half;
        }
    };
    for_each_chunk(size_, start_chunk, points_per_chunk);
}

// No impulse moves out a point that impacts have left inside but separating.
void ShapeContacts::skip_separating(ShapeContact& contact, const Substep& step)
{
    const std::uint32_t i = contact.i;
    if (step.paths[i].sweep > 0 && contact.n.dot(step.v[i] - contact.vc) >= 0)
        contact.level = std::min(contact.level, contact.n.dot(step.points[i].P));
}

void ShapeContacts::find(Batch& contacts, const Batch& before, const Substep& step, std::span<const Vec3d> free,
                         std::size_t begin, std::size_t end)
{
    thread_local PerThread<ShapeQuery> kept;
    ShapeQuery& query = *kept;
    query.free = free;
    query.begin = begin;
    query.sizes = sizes_;
    query.since = (step.index + 1) * step.dt;
    clearance_.open(query, step, end);
    contacts.clear();
    auto known = before.begin();
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        const Obstacle& obstacle = obstacles_[o];
        if (obstacle.response == Response::Die) continue;
        clearance_.query(query, o, step);
        const std::size_t first = contacts.size();
        for (std::size_t k = 0; k < query.queried.size(); ++k) {
            const std::uint32_t i = query.queried[k];
            if (query.phi[k] - obstacle.radius[i] > query.reach(obstacle, i) || !(query.gradient[k].norm() > 0))
                continue;
            ShapeContact made = contact(query, k, o, step);
            while (known != before.end() && std::pair(known->obstacle, known->i) < std::pair(made.obstacle, i)) ++known;
            if (known != before.end() && known->obstacle == made.obstacle && known->i == i) {
                made.normal_impulse = made.carried_impulse = 0.5 * (known->normal_impulse + known->carried_impulse);
                made.tangential_impulse = known->tangential_impulse - made.n.dot(known->tangential_impulse) * made.n;
                made.rolling_impulse = known->rolling_impulse;
            }
            contacts.push_back(made);
        }
        clearance_.close(query, o);
        if (sleep_) keep_sleeper_contacts(contacts, first, before, o);
    }
}

ShapeContacts::ShapeContact ShapeContacts::contact(const ShapeQuery& query, std::size_t k, std::size_t o,
                                                   const Substep& step) const
{
    const Obstacle& obstacle = obstacles_[o];
    ShapeContact contact{};
    contact.i = query.queried[k];
    contact.obstacle = static_cast<std::uint32_t>(o);
    contact.n = query.gradient[k] / query.gradient[k].norm();
    contact.vc = obstacle.shape->velocity_at(query.P[k], query.since);
    contact.level = contact.n.dot(query.P[k]) - std::max(0.0, query.phi[k] - obstacle.radius[contact.i]);
    contact.friction = friction_of(obstacle, contact.i);
    if (turns(step, contact.i)) follow_turning(contact, query.P[k], query.since);
    return contact;
}

// A turning point uses the surface velocity at its contact and the body's angular velocity.
void ShapeContacts::follow_turning(ShapeContact& contact, const Vec3d& P, double time) const
{
    const Obstacle& obstacle = obstacles_[contact.obstacle];
    const double radius = obstacle.radius[contact.i];
    if (!obstacle.moves || !(radius > 0)) return;
    contact.turning = turning_of(obstacle, P, radius, time);
    contact.vc = obstacle.shape->velocity_at(P - radius * contact.n, time);
}

// Keeps the contacts of sleepers with a shape unchanged and inactive.
void ShapeContacts::keep_sleeper_contacts(Batch& contacts, std::size_t begin, const Batch& before,
                                          std::size_t obstacle) const
{
    const auto middle = static_cast<std::ptrdiff_t>(contacts.size());
    for (const ShapeContact& contact : before)
        if (contact.obstacle == obstacle && sleep_->asleep(contact.i)) contacts.push_back(contact);
    std::inplace_merge(contacts.begin() + static_cast<std::ptrdiff_t>(begin), contacts.begin() + middle, contacts.end(),
                       [](const ShapeContact& a, const ShapeContact& b) { return a.i < b.i; });
}

void ShapeContacts::project(Substep& step)
{
    tbb::parallel_for(std::size_t{0}, contacts_.size(), [&](std::size_t c) {
        for (ShapeContact& contact : contacts_[c]) {
            ProjectedPoint& at = step.points[contact.i];
            if (!(at.w > 0)) continue;
            const double C = contact.n.dot(at.P) - contact.level;
            const double change = std::max(-contact.normal_impulse, -C / (at.w * step.dt));
            contact.normal_impulse += change;
            at.P += at.w * step.dt * change * contact.n;
        }
    });
}

void ShapeContacts::solve_velocities(Substep& step)
{
    tbb::parallel_for(std::size_t{0}, contacts_.size(), [&](std::size_t c) {
        for (ShapeContact& contact : contacts_[c]) {
            const std::uint32_t i = contact.i;
            if (!(step.points[i].w > 0)) continue;
            if (is_flush(contact, step)) {
                step.next_support[i] = 255;
                if (!step.next_support_v.empty()) step.next_support_v[i] = contact.vc;
            }
            solve_velocity(contact, step);
        }
        move_out(contacts_[c], step);
    });
}

bool ShapeContacts::is_flush(const ShapeContact& contact, const Substep& step) const
{
    const double gap = contact.n.dot(step.points[contact.i].P) - contact.level;
    return gap < flush * push_radius(sizes_, obstacles_[contact.obstacle], contact.i);
}

void ShapeContacts::drive(EnergyIslands& islands, const Substep& step) const
{
    const double now = (step.index + 1) * step.dt;
    for (const Batch& contacts : contacts_)
        for (const ShapeContact& contact : contacts) {
            const std::uint32_t i = contact.i;
            if (!(contact.normal_impulse > 0) && !(turns(step, i) && contact.free_impulse > 0)) continue;
            const Obstacle& obstacle = obstacles_[contact.obstacle];
            Drive by;
            double rolling = 0;
            if (obstacle.moves) {
                const Vec3d before = obstacle.shape->velocity_at(step.points[i].P, now - step.dt);
                const Vec3d after = obstacle.shape->velocity_at(step.points[i].P, now);
                by = Drive::of(contact.vc - (after - before), contact.vc, step.dt);
                rolling = obstacle.radius[i] * contact.turning.norm();
            }
            islands.drive(i, by, rolling);
        }
}

// Distributes the impulses of shapes in free motion among the contacts found at its end.
void ShapeContacts::share_reactions(const Substep& step)
{
    tbb::parallel_for(std::size_t{0}, contacts_.size(), [&](std::size_t c) {
        std::vector<ShapeContact*> by_point;
        for (ShapeContact& contact : contacts_[c]) by_point.push_back(&contact);
        std::stable_sort(by_point.begin(), by_point.end(),
                         [](const ShapeContact* a, const ShapeContact* b) { return a->i < b->i; });
        Batch missed;
        auto first = by_point.begin();
        const std::size_t end = std::min(size_, (c + 1) * points_per_chunk);
        for (std::size_t i = c * points_per_chunk; i < end; ++i) {
            const auto last = std::find_if(first, by_point.end(), [&](const ShapeContact* at) { return at->i != i; });
            if (step.points[i].w > 0 && !step.reaction[i].isZero(0))
                share_reaction({first, last}, static_cast<std::uint32_t>(i), step, missed);
            first = last;
        }
        contacts_[c].insert(contacts_[c].end(), missed.begin(), missed.end());
        if (!missed.empty()) std::sort(contacts_[c].begin(), contacts_[c].end(), is_before);
    });
}

void ShapeContacts::share_reaction(std::span<ShapeContact* const> contacts, std::uint32_t i, const Substep& step,
                                   Batch& missed) const
{
    thread_local PerThread<std::vector<Vec3d>> kept_normals;
    thread_local PerThread<std::vector<double>> kept_parts;
    std::vector<Vec3d>& normals = *kept_normals;
    std::vector<double>& parts = *kept_parts;
    const Vec3d impulse = step.reaction[i] / step.inverse_mass[i];
    normals.clear();
    for (const ShapeContact* contact : contacts) normals.push_back(contact->n);
    parts.resize(contacts.size());
    const Vec3d tangential = split_impulse(impulse, normals, parts);
    const double whole = std::accumulate(parts.begin(), parts.end(), 0.0);
    for (std::size_t k = 0; k < contacts.size() && whole > 0; ++k) {
        contacts[k]->free_impulse = parts[k];
        contacts[k]->free_friction = parts[k] / whole * tangential;
    }
    if (whole > 0) return;
    // The point has bounced and is out of reach by now.
    if (!turns(step, i)) {
        if (step.forces) step.forces->add(i, impulse.norm(), 0);
        return;
    }
    std::optional<ShapeContact> contact = missed_contact(i, impulse, step);
    if (!contact) return;
    const auto same = std::find_if(contacts.begin(), contacts.end(),
                                   [&](const ShapeContact* other) { return other->obstacle == contact->obstacle; });
    if (same == contacts.end())
        missed.push_back(*contact);
    else
        (*same)->free_impulse = impulse.norm();
}

// Builds a contact with the nearest shape.
std::optional<ShapeContacts::ShapeContact> ShapeContacts::missed_contact(std::uint32_t i, const Vec3d& impulse,
                                                                         const Substep& step) const
{
    const double since = (step.index + 1) * step.dt;
    const Vec3d P = step.points[i].P;
    std::optional<ShapeContact> nearest;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        const Obstacle& obstacle = obstacles_[o];
        if (obstacle.response == Response::Die || !obstacle.members[i]) continue;
        double phi = 0;
        obstacle.shape->distance_at({&P, 1}, {&since, 1}, {&phi, 1}, {});
        const double gap = std::max(0.0, phi - obstacle.radius[i]);
        if (!(gap < least)) continue;
        least = gap;
        ShapeContact& contact = nearest.emplace();
        contact.i = i;
        contact.obstacle = static_cast<std::uint32_t>(o);
        contact.n = impulse.normalized();
        contact.vc = obstacle.shape->velocity_at(P, since);
        contact.level = contact.n.dot(P) - gap;
        contact.friction = friction_of(obstacle, i);
        contact.free_impulse = impulse.norm();
        if (turns(step, i)) follow_turning(contact, P, since);
    }
    return nearest;
}

void ShapeContacts::add_forces(const Substep& step) const
{
    tbb::parallel_for(std::size_t{0}, contacts_.size(), [&](std::size_t c) {
        for (const ShapeContact& contact : contacts_[c]) {
            const std::uint32_t i = contact.i;
            const double normal = contact.free_impulse + contact.normal_impulse;
            if (!(step.points[i].w > 0) || !(normal > 0)) continue;
            const Vec3d tangential = contact.free_friction + contact.tangential_impulse;
            const Vec3d slip = (step.points[i].P - step.start[i]) / step.dt - contact.vc;
            step.forces->add(i, normal, tangential.norm());
            step.forces->add_work(i, contact.friction > 0 ? tangential.dot(slip) : 0,
                                  (normal * contact.n + tangential).dot(contact.vc));
            if (is_flush(contact, step)) step.forces->count(i);
        }
    });
}

// Removes the remaining velocity into the shape, then applies Coulomb friction from the total normal impulse. Friction
// acts throughout the substep, so half of it also moves the position; otherwise a held point would creep.
void ShapeContacts::solve_velocity(ShapeContact& contact, Substep& step)
{
    const double w = step.points[contact.i].w, before = contact.normal_impulse + contact.carried_impulse;
    contact.carried_impulse = 0;
    contact.normal_impulse = before;
    if (turns(step, contact.i)) return solve_spinning(contact, step);
    if (!(before > 0)) return;
    Vec3d& v = step.v[contact.i];
    const double normal = std::max(0.0, before - (v - contact.vc).dot(contact.n) / w);
    v += w * (normal - before) * contact.n;
    contact.normal_impulse = normal;
    if (contact.friction == 0) return;
    const Vec3d relative = v - contact.vc;
    Vec3d tangential = contact.tangential_impulse - (relative - relative.dot(contact.n) * contact.n) / w;
    const double most = contact.friction * normal, size = tangential.norm();
    if (size > most) tangential *= most / size;
    const Vec3d change = w * (tangential - contact.tangential_impulse);
    v += change;
    step.points[contact.i].P += time_of_force(step, contact.i) * change;
    contact.tangential_impulse = tangential;
}

// Starts friction and rolling friction, as far as they turn the point. A contact without load holds nothing.
void ShapeContacts::start_spinning(ShapeContact& contact, Substep& step)
{
    if (contact.normal_impulse + contact.free_impulse > 0) {
        const ShapeFriction friction{contact.tangential_impulse, contact.rolling_impulse};
        friction.start(step.spins[contact.i], step.points[contact.i].w, contact.n);
    } else {
        contact.tangential_impulse.setZero();
        contact.rolling_impulse.setZero();
    }
}

// Solves the same for a turning point, which had no friction in free motion, so the load includes the shape's impulse
// there.
void ShapeContacts::solve_spinning(ShapeContact& contact, Substep& step)
{
    const double w = step.points[contact.i].w;
    Vec3d& v = step.v[contact.i];
    if (contact.normal_impulse > 0) {
        const double normal = std::max(0.0, contact.normal_impulse - (v - contact.vc).dot(contact.n) / w);
        v += w * (normal - contact.normal_impulse) * contact.n;
        contact.normal_impulse = normal;
    }
    ShapeFriction friction{contact.tangential_impulse, contact.rolling_impulse};
    const Vec3d change = friction.solve(step.spins[contact.i], w, contact.n, v - contact.vc, contact.turning,
                                        contact.friction, contact.normal_impulse + contact.free_impulse);
    v += change;
    step.points[contact.i].P += time_of_force(step, contact.i) * change;
    contact.tangential_impulse = friction.tangential;
    contact.rolling_impulse = friction.rolling;
}

// Final penetration correction.
void ShapeContacts::move_out(const Batch& contacts, Substep& step) const
{
    struct Queried {
        std::vector<Vec3d> P, gradient;
        std::vector<double> phi, time;
    };
    thread_local PerThread<Queried> kept;
    auto& [P, gradient, phi, time] = *kept;
    for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
        const Obstacle& obstacle = obstacles_[contacts[begin].obstacle];
        P.clear();
        for (; end < contacts.size() && contacts[end].obstacle == contacts[begin].obstacle; ++end)
            P.push_back(step.points[contacts[end].i].P);
        phi.resize(P.size());
        gradient.resize(P.size());
        time.assign(P.size(), (step.index + 1) * step.dt);
        obstacle.shape->distance_at(P, time, phi, gradient);
        for (std::size_t k = 0; k < P.size(); ++k) {
            ProjectedPoint& at = step.points[contacts[begin + k].i];
            const double slope2 = gradient[k].squaredNorm();
            const double depth = obstacle.radius[contacts[begin + k].i] - phi[k];
            if (depth > 0 && slope2 > 0 && at.w > 0) at.P += depth / slope2 * gradient[k];
        }
    }
}

}  // namespace rapid
