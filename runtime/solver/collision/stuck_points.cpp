#include "runtime/solver/collision/stuck_points.h"

#include <algorithm>
#include <cmath>

namespace rapid {
namespace {

// Tolerance for the velocity of a point on a surface, which has single precision: relative, and absolute in m/s.
constexpr double velocity_tolerance = 1e-6;

// The smallest slope of a distance. A flatter field, as in the middle of a shape, does not lead to the surface.
constexpr double min_slope = 0.5;

// Parts of a substep that are searched for the time at which a point is torn off, and the bisections within one part.
constexpr int parts_of_step = 8, bisections = 40;

}  // namespace

void StuckPoints::begin()
{
    columns_ = block_.context.stuck;
    first_ = true;
    taken_.assign(block_.size(), Free);
    given_.assign(block_.size(), std::nullopt);
    list_.clear();
    loose_.clear();
    carried_.clear();
    torn_.clear();
    held_.resize(block_.obstacles.size());
}

void StuckPoints::advance()
{
    if (!columns_) return;
    for (const std::uint32_t i : list_) taken_[i] = Free;
    for (const Loose& loose : loose_) taken_[loose.i] = Free;
    list_.clear();
    loose_.clear();
    carried_.clear();
    find_held();
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
        query(o, held_[o]);
        for (std::size_t j = 0; j < query_.size(); ++j) {
            const std::uint32_t i = query_.point[j];
            const Gap gap{query_.phi[j] - block_.radius(block_.obstacles[o], i), query_.gradient[j]};
            if (columns_->face[block_.indices[i]] == StuckColumns::sliding)
                advance_sliding(i, static_cast<int>(o), gap);
            else
                advance_glued(i, static_cast<int>(o), gap);
        }
    }
    if (first_) find_resting();
    first_ = false;
}

// Sorts the points by the obstacle that holds them.
void StuckPoints::find_held()
{
    for (std::vector<std::uint32_t>& points : held_) points.clear();
    torn_.clear();
    for (std::uint32_t i = 0; i < block_.size(); ++i) {
        const std::int32_t to = columns_->to[block_.indices[i]];
        if (to == 0) continue;
        std::size_t o = 0;
        while (o < block_.obstacles.size() && block_.obstacles[o].key != std::abs(to)) ++o;
        if (o == block_.obstacles.size() || !block_.has_member(block_.obstacles[o], i) ||
            !block_.obstacles[o].holds()) {
            release(i);
        } else if (to < 0) {
            torn_.push_back(i);
        } else {
            held_[o].push_back(i);
        }
    }
}

void StuckPoints::query(std::size_t o, const std::vector<std::uint32_t>& points)
{
    query_.clear();
    for (const std::uint32_t i : points) {
        const double now = block_.frame_time(i, block_.dt[i]);
        const bool slides = columns_->face[block_.indices[i]] == StuckColumns::sliding;
        const int obstacle = static_cast<int>(o);
        const bool here = slides || is_elsewhere(i, obstacle, now);
        query_.add(i, here ? block_.P[i] : state(i, obstacle, now).P, now);
    }
    if (!query_.empty()) query_.find_gradients_at_times(*block_.obstacles[o].shape);
}

// Finds points that lie on a surface with its velocity, because they were born on it or placed there.
void StuckPoints::find_resting()
{
    std::vector<std::uint32_t> near;
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
        const Obstacle& obstacle = block_.obstacles[o];
        if (!obstacle.sticks()) continue;
        query_.clear();
        for (std::uint32_t i = 0; i < block_.size(); ++i) {
            if (columns_->to[block_.indices[i]] != 0 || !block_.has_member(obstacle, i) || !(block_.dt[i] > 0))
                continue;
            if (obstacle.is_clear_of(block_.P[i], block_.radius(obstacle, i))) continue;
            query_.add(i, block_.P[i], block_.frame_time(i, block_.dt[i]));
        }
        if (query_.empty()) continue;
        query_.find_distances_at_times(*obstacle.shape);
        for (std::size_t j = 0; j < query_.size(); ++j) {
            const std::uint32_t i = query_.point[j];
            const double radius = block_.radius(obstacle, i), now = query_.time[j];
            if (std::abs(query_.phi[j] - radius) > obstacle.contact_tolerance(block_.P[i], radius)) continue;
            const Vec3d vc = obstacle.shape->velocity_at(block_.P[i], now);
            if ((block_.v[i] - vc).norm() > velocity_tolerance * (1 + vc.norm())) continue;
            glue(i, static_cast<int>(o), now);
            advance_glued(i, static_cast<int>(o), {});
        }
    }
}

// The gap is measured at the position that holds the point, or at the point itself if it is elsewhere.
void StuckPoints::advance_glued(std::uint32_t i, int o, const Gap& gap)
{
    const Obstacle& obstacle = obstacle_at(o);
    const std::uint32_t index = block_.indices[i];
    const double now = block_.frame_time(i, block_.dt[i]), radius = block_.radius(obstacle, i);
    const Vec3d P = block_.P[i], v = block_.v[i];
    const bool begins = begins_frame(i), moved = is_elsewhere(i, o, now);
    const MaterialPoint at = material(i, o);
    if (moved || (begins && at.face == MaterialPoint::rigid)) {
        // The point's size or the surface has changed. The point stays if the surface is within its reach.
        const double tolerance = obstacle.contact_tolerance(block_.P[i], radius), slope2 = gap.gradient.squaredNorm();
        const bool off = std::abs(gap.f) > tolerance;
        if (std::abs(gap.f) > std::max({tolerance, radius, 2 * obstacle.feature})) return release(i);
        if (off && slope2 < min_slope * min_slope) return release(i);
        if (!moved) block_.P[i] = state(i, o, now).P;
        if (off) block_.P[i] -= gap.f / slope2 * gap.gradient;
        if (moved || off) glue(i, o, now);
    } else if (obstacle.body && !obstacle.body->has(at)) {
        glue(i, o, now);
    }

    const MovingBody::State here = state(i, o, now);
    const Vec3d kick = kick_on(i, given_[i].value_or(here.v));
    const double torn = time_of_tearing(i, o, kick, now);
    touched_.set_only_plane(i, -1);
    touched_.add(i);
    if (!(torn < block_.dt[i])) {
        taken_[i] = Glued;
        list_.push_back(i);
        block_.P[i] = here.P, block_.v[i] = here.v;
        move_with_surface(i, o, now, block_.dt[i]);
        return carried_.push_back({i, P, v, block_.P[i], block_.v[i]});
    }
    columns_->to[index] = -obstacle.key;
    torn_.push_back(i);
    taken_[i] = Released;
    given_[i].reset();
    const MovingBody::State there = state(i, o, now + torn);
    block_.P[i] = there.P;
    if (torn > 0) block_.v[i] = there.v;
    carried_.push_back({i, P, v, block_.P[i], block_.v[i]});
    loose_.push_back({i, block_.dt[i] - torn, std::nullopt});
}

void StuckPoints::advance_sliding(std::uint32_t i, int o, const Gap& gap)
{
    const Obstacle& obstacle = obstacle_at(o);
    const std::uint32_t index = block_.indices[i];
    const double now = block_.frame_time(i, block_.dt[i]), radius = block_.radius(obstacle, i);
    const double reach = std::max(obstacle.contact_tolerance(block_.P[i], radius), 0.25 * obstacle.feature);
    const double slope = gap.gradient.norm(), adhesion = obstacle.adhesion[index];
    if (std::abs(gap.f) > reach || !(slope > 0)) return release(i);
    const Vec3d n = gap.gradient / slope, P = block_.P[i] - gap.f / slope * n;
    const Vec3d vc = obstacle.shape->velocity_at(P, now);
    Support on{o, n, vc, 0, obstacle.friction[index], obstacle.plane.has_value(), obstacle.feature};
    on.viscosity = obstacle.viscosity[index];
    on.adhesion = adhesion;
    const Vec3d given = block_.v[i], v = tangential_to(on, given);
    on.ac = obstacle.acceleration_at(P, v, now);
    // Without a kick, the slide decides if the point leaves, because it accounts for the turning of the surface.
    const bool is_kicked = (given - vc).dot(n) > velocity_tolerance * (1 + given.norm());
    if (is_kicked && (kick_on(i, vc) + motion_.acceleration(i) - on.ac).dot(n) > adhesion) return release(i);
    carried_.push_back({i, block_.P[i], block_.v[i], P, v});
    block_.P[i] = P;
    block_.v[i] = v;
    touched_.set_only_plane(i, -1);
    touched_.add(i);
    taken_[i] = Released;
    loose_.push_back({i, block_.dt[i], on});
}

void StuckPoints::hold(std::size_t i, int o, double left)
{
    const auto point = static_cast<std::uint32_t>(i);
    const double now = block_.frame_time(i, left);
    if (!columns_) return;
    glue(point, o, now);
    move_with_surface(point, o, now, left);
}

// Glues the point to its current position on the surface.
void StuckPoints::glue(std::uint32_t i, int o, double now)
{
    const Obstacle& obstacle = obstacle_at(o);
    const std::uint32_t index = block_.indices[i];
    MaterialPoint at{MaterialPoint::rigid, block_.P[i]};
    if (obstacle.body) at = obstacle.body->material_at(block_.P[i], now);
    if (at.face != MaterialPoint::rigid) at.at.z() -= block_.radius(obstacle, i);
    columns_->to[index] = obstacle.key;
    columns_->face[index] = at.face;
    columns_->at[index] = at.at.cast<float>();
}

// Moves the point with the surface from `now` on for the given duration.
void StuckPoints::move_with_surface(std::uint32_t i, int o, double now, double duration)
{
    const Obstacle& obstacle = obstacle_at(o);
    if (obstacle.body) {
        const MovingBody::State there = state(i, o, now + duration);
        block_.P[i] = there.P;
        block_.v[i] = there.v;
    } else {
        block_.v[i].setZero();
    }
    given_[i] = block_.v[i];
    touched_.set_surface(i, {o, obstacle.normal_at(block_.P[i], now + duration)});
}

MaterialPoint StuckPoints::material(std::uint32_t i, int o) const
{
    const std::uint32_t index = block_.indices[i];
    MaterialPoint point{columns_->face[index], columns_->at[index].cast<double>()};
    if (point.face != MaterialPoint::rigid) point.at.z() += block_.radius(obstacle_at(o), i);
    return point;
}

// Returns the state of the surface point at a time.
MovingBody::State StuckPoints::state(std::uint32_t i, int o, double time) const
{
    const Obstacle& obstacle = obstacle_at(o);
    const MaterialPoint point = material(i, o);
    if (obstacle.body && obstacle.body->has(point)) return obstacle.body->follow(point, time);
    return {block_.P[i], obstacle.shape->velocity_at(block_.P[i], time), Vec3d::Zero()};
}

bool StuckPoints::begins_frame(std::uint32_t i) const
{
    return first_ && block_.frame_time(i, block_.dt[i]) <= 1e-9 * block_.context.h;
}

// Returns true if a script has moved the point between two frames, or if rows have moved it in the substep of its
// impact. Rows have then reached their balance with it, and afterwards do not move a permanently held point.
bool StuckPoints::is_elsewhere(std::uint32_t i, int o, double now) const
{
    if (begins_frame(i)) return columns_->P[block_.indices[i]] != block_.P[i].cast<float>();
    if (!bond_is_endless(i, o)) return false;
    const Obstacle& obstacle = obstacle_at(o);
    const double tolerance = obstacle.contact_tolerance(block_.P[i], block_.radius(obstacle, i));
    return (state(i, o, now).P - block_.P[i]).norm() > tolerance;
}

bool StuckPoints::is_held_for_good(std::size_t i) const
{
    if (!has(i)) return false;
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o)
        if (block_.obstacles[o].key == columns_->to[block_.indices[i]]) return bond_is_endless(i, static_cast<int>(o));
    return false;
}

// Returns the kick of a script, an action or a neighbour: the difference of the point's velocity from that of the
// surface, as an acceleration, m/s². A kick between two frames counts as an acceleration throughout the next frame.
Vec3d StuckPoints::kick_on(std::uint32_t i, const Vec3d& v) const
{
    const double over = begins_frame(i) ? block_.context.h : block_.context.drifts * block_.dt[i];
    return over > 0 ? Vec3d((block_.v[i] - v) / over) : Vec3d(Vec3d::Zero());
}

// Returns the load on the bond to the surface, m/s²: with the acceleration b that the surface would have to supply,
//
//   b = a_surface - pull,   N = b·n,   sqrt(max(0, -N)² + max(0, |b - N n| - μ max(0, N))²)
double StuckPoints::tension(std::uint32_t i, int o, const Vec3d& pull, double time) const
{
    const Obstacle& obstacle = obstacle_at(o);
    const MovingBody::State there = state(i, o, time);
    const Vec3d b = there.a - pull, n = obstacle.normal_at(there.P, time);
    const double N = b.dot(n), along = (b - N * n).norm();
    return std::hypot(std::max(0.0, -N),
                      std::max(0.0, along - obstacle.friction[block_.indices[i]] * std::max(0.0, N)));
}

// Returns the time until the bond tears, s from `now` on; infinite if it holds throughout the substep.
double StuckPoints::time_of_tearing(std::uint32_t i, int o, const Vec3d& kick, double now) const
{
    const double adhesion = obstacle_at(o).adhesion[block_.indices[i]], dt = block_.dt[i];
    if (std::isinf(adhesion) || !(dt > 0)) return Contact::none;
    const Vec3d pull = motion_.acceleration(i) + kick;
    const auto tears = [&](double s) { return tension(i, o, pull, now + s) > adhesion; };
    if (tears(0)) return 0;
    if (!obstacle_at(o).body) return Contact::none;
    for (int k = 1; k <= parts_of_step; ++k) {
        double low = dt * (k - 1) / parts_of_step, high = dt * k / parts_of_step;
        if (!tears(high)) continue;
        for (int bisection = 0; bisection < bisections; ++bisection) {
            const double middle = 0.5 * (low + high);
            (tears(middle) ? high : low) = middle;
        }
        return high;
    }
    return Contact::none;
}

void StuckPoints::finish(std::span<const std::uint32_t> met)
{
    if (!columns_) return;
    met_.assign(block_.size(), 0);
    const auto touches = [&](std::uint32_t i, const auto& holds) {
        const TouchedPoints::Surfaces& on = touched_.surfaces(i);
        return std::any_of(on.begin(), on.end(), [&](const TouchedPoints::Surface& surface) {
            return surface.obstacle >= 0 && holds(obstacle_at(surface.obstacle));
        });
    };
    const auto settle = [&](std::uint32_t i) {
        met_[i] = 1;
        std::int32_t& to = columns_->to[block_.indices[i]];
        if (to < 0) return;
        std::int32_t& face = columns_->face[block_.indices[i]];
        if (to > 0 && face != StuckColumns::sliding) return;
        to = 0;
        touches(i, [&](const Obstacle& obstacle) {
            if (!obstacle.clings() || !obstacle.holds()) return false;
            to = obstacle.key;
            face = StuckColumns::sliding;
            return true;
        });
    };
    for (const std::uint32_t i : met) settle(i);
    for (const Loose& loose : loose_) settle(loose.i);
    for (const std::uint32_t i : torn_) {
        std::int32_t& to = columns_->to[block_.indices[i]];
        if (to < 0 && !(met_[i] && touches(i, [&](const Obstacle& obstacle) { return obstacle.key == -to; }))) to = 0;
    }
}

void StuckPoints::keep(std::span<const Vec3f> P)
{
    for (std::size_t i = 0; columns_ && i < block_.size(); ++i)
        if (columns_->to[block_.indices[i]] > 0) columns_->P[block_.indices[i]] = P[i];
}

}  // namespace rapid
