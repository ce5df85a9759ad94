#include "runtime/solver/constraints/shape_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/parallel.h"
#include "runtime/solver/constraints/rows.h"

namespace rapid {
namespace {

// How far a point may be pushed within a sub-step and still be kept out of a shape that it was not near: this part of
// its radius, and its own way once more. One that is pushed farther is found inside at the next sub-step.
constexpr double push = 0.5;

// A point lies on a shape that is as near to it as this, in radii.
constexpr double flush = 0.01;

// Points that are seen to together.
constexpr std::size_t points_a_task = 2048;

}  // namespace

ShapeContacts::ShapeContacts(std::span<const Obstacle> obstacles, std::size_t size)
    : obstacles_(obstacles),
      size_(size),
      rows_((size + points_a_task - 1) / points_a_task),
      before_(rows_.size()),
      clearance_(obstacles.size() * size, -1.0f),
      room_(size, -1.0f)
{
}

void ShapeContacts::recall(const ShapeLoads& loads, const Column<std::int64_t>& ids, double dt)
{
    const PlacesById place(ids);
    for (const ShapeLoads::Load& load : loads.loads) {
        const std::uint32_t i = place[load.id];
        if (i == PlacesById::none || load.obstacle >= obstacles_.size()) continue;
        Row row{};
        row.i = i;
        row.obstacle = load.obstacle;
        row.pressed = row.held = 0.5 * dt * load.normal;
        row.rubbed = dt * load.tangent.cast<double>();
        rows_[i / points_a_task].push_back(row);
    }
    for (Batch& rows : rows_)
        std::sort(rows.begin(), rows.end(),
                  [](const Row& a, const Row& b) { return std::pair(a.obstacle, a.i) < std::pair(b.obstacle, b.i); });
}

void ShapeContacts::remember(ShapeLoads& loads, const Column<std::int64_t>& ids, double dt) const
{
    loads.loads.clear();
    for (const Batch& rows : rows_)
        for (const Row& row : rows)
            if (row.pressed + row.held > 0)
                loads.loads.push_back({ids[row.i], row.obstacle, static_cast<float>((row.pressed + row.held) / dt),
                                       (row.rubbed / dt).cast<float>()});
}

void ShapeContacts::prepare(Substep& now, std::span<const Vec3d> free)
{
    if (asked_at_.empty()) asked_at_.assign(free.begin(), free.end());
    std::swap(rows_, before_);
    const auto see_to = [&](std::size_t begin, std::size_t end) {
        Batch& rows = rows_[begin / points_a_task];
        find(rows, before_[begin / points_a_task], now, free, begin, end);
        for (Row& row : rows) {
            const double w = now.at[row.i].w;
            if (!(row.pressed > 0) || !(w > 0)) continue;
            const Vec3d half = 0.5 * ((row.pressed + row.held) * row.n + row.rubbed);
            now.at[row.i].P += w * now.dt * half;
            now.v[row.i] += w * half;
        }
    };
    for_each_chunk(size_, see_to, points_a_task);
}

void ShapeContacts::find(Batch& rows, Batch& before, const Substep& now, std::span<const Vec3d> free, std::size_t begin,
                         std::size_t end)
{
    thread_local std::vector<std::uint32_t> open, asked;
    thread_local std::vector<Vec3d> P, gradient;
    thread_local std::vector<double> phi, time, own, since_asked;
    const double since = (now.index + 1) * now.dt;  // s, since the frame began

    // Most are known to be far from all shapes, or close to one for long: without a branch.
    const bool any_moves = std::any_of(obstacles_.begin(), obstacles_.end(), [](const Obstacle& o) { return o.moves; });
    open.resize(end - begin + 1);
    std::size_t near_any = 0;
    for (std::size_t i = begin; i < end; ++i) {
        // At least (|own way| + |way since asked|)².
        const double gone2 = 2 * ((free[i] - now.begin[i]).squaredNorm() + (free[i] - asked_at_[i]).squaredNorm());
        open[near_any] = static_cast<std::uint32_t>(i);
        near_any += any_moves | !(room_[i] > 0 && double(room_[i]) * double(room_[i]) > gone2);
    }
    open.resize(near_any);
    own.resize(end - begin);
    since_asked.resize(end - begin);
    for (const std::uint32_t i : open) {
        own[i - begin] = (free[i] - now.begin[i]).norm();
        since_asked[i - begin] = (free[i] - asked_at_[i]).norm();
        room_[i] = std::numeric_limits<float>::infinity();
    }
    rows.clear();
    std::size_t old = 0;
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        const Obstacle& obstacle = obstacles_[o];
        if (obstacle.response == Response::Die) continue;
        float* clearance = clearance_.data() + o * size_;
        const auto reach = [&](std::size_t i) { return push * obstacle.radius[i] + own[i - begin]; };
        asked.resize(open.size() + 1);
        std::size_t near = 0;
        for (const std::uint32_t i : open) {
            asked[near] = i;
            near += obstacle.moves | (clearance[i] < since_asked[i - begin] + reach(i));
        }
        asked.resize(near);
        P.clear();
        std::erase_if(asked, [&](std::uint32_t i) {
            if (!(now.at[i].w > 0) || !obstacle.members[i] || !now.lives(i)) return true;
            const double off = (free[i] - obstacle.bounds.max()).cwiseMax(obstacle.bounds.min() - free[i]).maxCoeff() -
                               obstacle.radius[i];
            if (off > reach(i)) {
                clearance[i] = static_cast<float>(off - since_asked[i - begin]);
                return true;
            }
            P.push_back(free[i]);
            return false;
        });
        const std::size_t rows_before = rows.size();
        phi.resize(P.size());
        gradient.resize(P.size());
        time.assign(P.size(), since);
        if (!asked.empty()) obstacle.shape->distance_at(P, time, phi, gradient);
        for (std::size_t k = 0; k < asked.size(); ++k) {
            const std::uint32_t i = asked[k];
            const double slope = gradient[k].norm(), gap = phi[k] - obstacle.radius[i];
            // Measured from where the point is now: what it was off asked_at_ is taken off.
            clearance[i] = static_cast<float>(gap - since_asked[i - begin]);
            if (gap > reach(i) || !(slope > 0)) continue;
            Row row{};
            row.i = i;
            row.obstacle = static_cast<std::uint32_t>(o);
            row.n = gradient[k] / slope;
            row.vc = obstacle.shape->velocity_at(P[k], since);
            row.level = row.n.dot(P[k]) - std::max(0.0, gap);
            row.friction = obstacle.response == Response::Stick ? std::numeric_limits<double>::max()
                                                                : double(obstacle.friction[i]);
            while (old < before.size() && std::pair(before[old].obstacle, before[old].i) < std::pair(row.obstacle, i))
                ++old;
            if (old < before.size() && before[old].obstacle == row.obstacle && before[old].i == i) {
                row.pressed = row.held = 0.5 * (before[old].pressed + before[old].held);
                row.rubbed = before[old].rubbed - row.n.dot(before[old].rubbed) * row.n;
            }
            rows.push_back(row);
        }
        for (const std::uint32_t i : open)
            if (obstacle.members[i])
                room_[i] = std::min(room_[i], clearance[i] - static_cast<float>(push) * obstacle.radius[i]);
        if (now.sleepers) keep_of_sleepers(rows, rows_before, before, o, now);
    }
}

// The rows of an obstacle on points that sleep: as they were, and out of use.
void ShapeContacts::keep_of_sleepers(Batch& rows, std::size_t begin, const Batch& before, std::size_t obstacle,
                                     const Substep& now)
{
    const auto middle = static_cast<std::ptrdiff_t>(rows.size());
    for (const Row& row : before)
        if (row.obstacle == obstacle && now.asleep(row.i)) rows.push_back(row);
    std::inplace_merge(rows.begin() + static_cast<std::ptrdiff_t>(begin), rows.begin() + middle, rows.end(),
                       [](const Row& a, const Row& b) { return a.i < b.i; });
}

void ShapeContacts::project(Substep& now)
{
    tbb::parallel_for(std::size_t{0}, rows_.size(), [&](std::size_t c) {
        for (Row& row : rows_[c]) {
            Place& at = now.at[row.i];
            if (!(at.w > 0)) continue;
            const double C = row.n.dot(at.P) - row.level;
            const double change = std::max(-row.pressed, -C / (at.w * now.dt));
            row.pressed += change;
            at.P += at.w * now.dt * change * row.n;
        }
    });
}

// The velocity that is left into the shape is taken off, and friction acts by all that presses. What friction does it
// does throughout the sub-step, and so half of it to the place: else a point that is held would creep.
void ShapeContacts::settle(Substep& now)
{
    tbb::parallel_for(std::size_t{0}, rows_.size(), [&](std::size_t c) {
        for (Row& row : rows_[c]) {
            const double w = now.at[row.i].w;
            if (!(w > 0)) continue;
            if (row.n.dot(now.at[row.i].P) - row.level < flush * obstacles_[row.obstacle].radius[row.i])
                now.found_borne[row.i] = 255;
            const double p = row.pressed + row.held;
            row.held = 0;
            row.pressed = p;
            if (!(p > 0)) continue;
            Vec3d& v = now.v[row.i];
            const double pressed = std::max(0.0, p - (v - row.vc).dot(row.n) / w);
            v += w * (pressed - p) * row.n;
            row.pressed = pressed;
            if (row.friction == 0) continue;
            const Vec3d relative = v - row.vc;
            Vec3d rubbed = row.rubbed - (relative - relative.dot(row.n) * row.n) / w;
            const double most = row.friction * pressed, size = rubbed.norm();
            if (size > most) rubbed *= most / size;
            const Vec3d change = w * (rubbed - row.rubbed);
            v += change;
            now.at[row.i].P += 0.5 * now.dt * change;
            row.rubbed = rubbed;
        }
        put_out(rows_[c], now);
    });
}

void ShapeContacts::put_out(Batch& rows, Substep& now) const
{
    thread_local std::vector<Vec3d> P, gradient;
    thread_local std::vector<double> phi, time;
    for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
        const Obstacle& obstacle = obstacles_[rows[begin].obstacle];
        P.clear();
        for (; end < rows.size() && rows[end].obstacle == rows[begin].obstacle; ++end)
            P.push_back(now.at[rows[end].i].P);
        phi.resize(P.size());
        gradient.resize(P.size());
        time.assign(P.size(), (now.index + 1) * now.dt);
        obstacle.shape->distance_at(P, time, phi, gradient);
        for (std::size_t k = 0; k < P.size(); ++k) {
            const double slope2 = gradient[k].squaredNorm(), depth = obstacle.radius[rows[begin + k].i] - phi[k];
            if (depth > 0 && slope2 > 0 && now.at[rows[begin + k].i].w > 0)
                now.at[rows[begin + k].i].P += depth / slope2 * gradient[k];
        }
    }
}

}  // namespace rapid
