#include "runtime/solver/constraints/sleep.h"

#include <algorithm>
#include <cmath>

#include "runtime/parallel.h"
#include "runtime/points/id_index.h"
#include "runtime/solver/collision/collisions.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/motion/ballistic_batch.h"

namespace rapid {
namespace {

// A point is still that goes no faster through a frame, and is no faster at its end, than these parts of what pulls it
// gives it in a sub-step (0.03 m/s at 12 sub-steps of 24 frames a second). Solving leaves a heap of 10,000 grains 0.03
// of it a second after it has stopped; more would hold a slope that still slides, less be reached much later.
constexpr double still_way = 0.05, still_speed = 0.25;

// What hangs is still that, in the time that it takes to fall asleep, gains no more speed than this part of what pulls
// it would give it. So a pendulum stays awake that is off by 2e-4 of its length, by any number of sub-steps.
constexpr double still_hanging = 1e-4;

// How much a pull may change until it is another, as a part of it: friction holds what lies, and nothing what hangs.
constexpr double another_pull = 0.1, another_pull_bound = 1e-3;

// A shape is touched that is as near as this, in radii: what rests on one is flush with it.
constexpr double touch = 0.01;

// What a shape that has come over a point, however slowly, adds to its grip.
constexpr float sunk = 1000;

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

}  // namespace

Sleepers::Sleepers(PointSet& points, const SleepMemory& memory, std::span<const double> weight,
                   std::span<const std::uint8_t> tied, const Islands& islands, double after)
    : points_(points),
      weight_(weight),
      islands_(islands),
      asleep_(points.size()),
      tied_(tied.begin(), tied.end()),
      pull_(points.size(), Vec3d::Constant(unknown)),
      grip_(points.size(), unknown),
      load_(points.size(), 0.0f),
      after_(after)
{
    const Strided<float> still = std::as_const(points).column<float>("still").read();
    const Strided<Vec3f> P = std::as_const(points).P().read(), v = std::as_const(points).v().read();
    for (std::size_t i = 0; i < asleep_.size(); ++i)
        asleep_[i] = still[i] >= after_ && weight_[i] > 0 && !tied_[i] && v[i].isZero(0);
    for (std::size_t k = 0; k < islands_.size(); ++k) {
        const std::span<const std::uint32_t> island = islands_[k];
        slept_.push_back(
            std::all_of(island.begin(), island.end(), [&](std::uint32_t i) { return still[i] >= after_; }));
    }
    const IdIndex index(points.id());
    for (const SleepMemory::Bed& bed : memory.beds) {
        const std::uint32_t i = index[bed.id];
        if (i == IdIndex::none) continue;
        if (P[i] != bed.P || weight_[i] != bed.weight) asleep_[i] = 0;
        pull_[i] = bed.pull.cast<double>();
        grip_[i] = bed.grip;
        load_[i] = bed.load;
    }
    for (std::size_t k = 0; k < islands_.size(); ++k) spread(k);
}

// Wakes all of an island unless all of it sleeps.
void Sleepers::spread(std::size_t k)
{
    const std::span<const std::uint32_t> island = islands_[k];
    if (std::all_of(island.begin(), island.end(), [&](std::uint32_t i) { return asleep_[i] != 0; })) return;
    for (const std::uint32_t i : island) asleep_[i] = 0;
}

void Sleepers::rouse(Substep& now)
{
    if (!woken_) return;
    for (std::size_t k = 0; k < islands_.size(); ++k) {
        const std::span<const std::uint32_t> island = islands_[k];
        spread(k);
        if (asleep_[island.front()]) continue;
        for (const std::uint32_t i : island)
            if (!(now.at[i].w > 0)) rouse(i, now);
    }
}

void Sleepers::rouse(std::size_t i, Substep& now)
{
    wake(i);
    if (islands_.holds(i)) return;
    now.at[i].w = weight_[i] * now.yield_of(i).v / now.dt;
    now.at[i].P += now.yield_of(i).x * pull_[i];
    now.v[i] += now.yield_of(i).v * pull_[i];
}

// Which shapes each point touches, and how they hold it: 1 and the friction for each.
std::vector<float> Sleepers::grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                                   std::span<const Vec3d> P, double time) const
{
    std::vector<float> result(points.size(), 0.0f);
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> asked;
        std::vector<Vec3d> at, none;
        std::vector<double> phi, times;
        for (const Obstacle& obstacle : obstacles) {
            asked.clear();
            at.clear();
            for (std::size_t k = begin; k < end; ++k) {
                const std::uint32_t i = points[k];
                const double reach = (1 + touch) * obstacle.radius[i];
                if (!obstacle.members[i] || obstacle.bounds.squaredExteriorDistance(P[i]) > reach * reach) continue;
                asked.push_back(static_cast<std::uint32_t>(k));
                at.push_back(P[i]);
            }
            if (asked.empty()) continue;
            phi.resize(at.size());
            times.assign(at.size(), time);
            obstacle.shape->distance_at(at, times, phi, {});
            for (std::size_t k = 0; k < asked.size(); ++k) {
                const std::uint32_t i = points[asked[k]];
                const double radius = obstacle.radius[i];
                if (phi[k] <= (1 + touch) * radius) result[asked[k]] += 1 + obstacle.friction[i];
                if (phi[k] < (1 - touch) * radius) result[asked[k]] += sunk;
            }
        }
    });
    return result;
}

void Sleepers::begin(const Substep& now, std::span<const Obstacle> obstacles)
{
    const double end = (now.index + 1) * now.dt;
    std::vector<std::uint32_t> sleepers;
    const auto list = [&] {
        sleepers.clear();
        for (std::size_t i = 0; i < asleep_.size(); ++i)
            if (asleep_[i]) sleepers.push_back(static_cast<std::uint32_t>(i));
        count_ = still_ = sleepers.size();
        for (std::size_t i = 0; i < asleep_.size(); ++i) still_ += !(weight_[i] > 0) && !tied_[i] && now.v[i].isZero(0);
    };
    list();
    if (sleepers.empty()) {
        woken_ = false;
        return;
    }

    std::vector<Vec3d> P(asleep_.size());
    for (const std::uint32_t i : sleepers) P[i] = now.at[i].P;
    if (now.index == 0) {
        const std::vector<float> found = grips(sleepers, obstacles, P, 0);
        for (std::size_t k = 0; k < sleepers.size(); ++k) {
            float& known = grip_[sleepers[k]];
            if (std::isnan(known)) known = found[k];
            if (known != found[k]) wake(sleepers[k]);
        }
    }
    for (const Obstacle& obstacle : obstacles) {
        if (!obstacle.moves) continue;
        for_each_chunk(sleepers.size(), [&](std::size_t first, std::size_t last) {
            std::vector<double> phi(1), time(1, end);
            for (std::size_t k = first; k < last; ++k) {
                const std::uint32_t i = sleepers[k];
                if (!obstacle.members[i]) continue;
                const double speed = obstacle.shape->velocity_at(P[i], end).norm();
                const double reach = (1 + touch) * obstacle.radius[i] + 2 * now.dt * speed;
                if (speed < still_way * now.dt * pull_[i].norm() ||
                    obstacle.bounds.squaredExteriorDistance(P[i]) > reach * reach)
                    continue;
                obstacle.shape->distance_at({&P[i], 1}, time, phi, {});
                if (phi[0] <= reach) wake(i);
            }
        });
    }
    for (std::size_t k = 0; woken_ && k < islands_.size(); ++k) spread(k);
    woken_ = false;
    list();
}

void Sleepers::feel(std::size_t i, const Vec3d& pull)
{
    const double another = islands_.binds(i) ? another_pull_bound : another_pull;
    if (asleep_[i] && pull_[i].allFinite() && (pull - pull_[i]).norm() > another * pull_[i].norm()) wake(i);
    if (!asleep_[i] || !pull_[i].allFinite()) pull_[i] = pull;
}

void Sleepers::unload()
{
    for (std::size_t i = 0; i < asleep_.size(); ++i)
        if (!asleep_[i]) load_[i] = 0;
}

// Those of islands in which nothing lies on a shape or on another point.
std::vector<std::uint8_t> Sleepers::find_hanging(const Substep& now) const
{
    std::vector<std::uint8_t> hangs(islands_.size() > 0 ? asleep_.size() : 0);
    for (std::size_t k = 0; k < islands_.size() && !now.found_borne.empty(); ++k) {
        const std::span<const std::uint32_t> island = islands_[k];
        if (std::none_of(island.begin(), island.end(),
                         [&](std::uint32_t i) { return load_[i] > 0 || now.found_borne[i] > 0; }))
            for (const std::uint32_t i : island) hangs[i] = 1;
    }
    return hangs;
}

void Sleepers::close(Substep& now, std::span<const Vec3f> begin, const OwnTime& lived)
{
    const auto h = static_cast<float>(lived.h);
    const std::span<float> still = points_.column<float>("still").write();
    const double gained = now.pull * now.dt;  // m/s, in a sub-step
    const double hanging = still_hanging * now.pull * after_;
    for (std::size_t k = 0; k < islands_.size(); ++k) spread(k);
    const std::vector<std::uint8_t> hangs = find_hanging(now);
    for_each_chunk(asleep_.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            if (asleep_[i]) continue;
            const bool bound = islands_.binds(i);
            const double most = bound && hangs[i] ? hanging : std::numeric_limits<double>::infinity();
            const double way = (now.at[i].P - begin[i].cast<double>()).norm();
            const bool is_still = weight_[i] > 0 && !tied_[i] && now.lives(i) && !(lived(i) < lived.h) && gained > 0 &&
                                  way <= std::min(still_way * gained, most) * lived.h &&
                                  now.v[i].norm() <= std::min(still_speed * gained, most);
            // A sleeper that has woken begins anew.
            still[i] = is_still && (bound || still[i] < after_) ? still[i] + h : 0;
            if (!bound && still[i] >= after_) rest(i, now);
        }
    });
    for (std::size_t k = 0; k < islands_.size(); ++k) {
        const std::span<const std::uint32_t> island = islands_[k];
        if (asleep_[island.front()]) continue;
        if (slept_[k])
            for (const std::uint32_t i : island) still[i] = 0;
        if (std::all_of(island.begin(), island.end(), [&](std::uint32_t i) { return still[i] >= after_; }))
            for (const std::uint32_t i : island) rest(i, now);
    }
}

void Sleepers::rest(std::size_t i, Substep& now)
{
    asleep_[i] = 1;
    grip_[i] = unknown;
    now.v[i].setZero();
}

void Sleepers::remember(SleepMemory& memory, const PointSet& points, const Substep& now,
                        std::span<const Obstacle> obstacles)
{
    std::vector<std::uint32_t> fresh;
    std::vector<Vec3d> P(asleep_.size());
    const Strided<Vec3f> rounded = points.P().read();
    for (std::size_t i = 0; i < asleep_.size(); ++i) {
        if (!asleep_[i]) continue;
        P[i] = rounded[i].cast<double>();
        if (std::isnan(grip_[i])) fresh.push_back(static_cast<std::uint32_t>(i));
    }
    const std::vector<float> found = grips(fresh, obstacles, P, (now.index + 1) * now.dt);
    for (std::size_t k = 0; k < fresh.size(); ++k) grip_[fresh[k]] = found[k];
    memory.beds.clear();
    const Strided<std::int64_t> id = points.id().read();
    for (std::size_t i = 0; i < asleep_.size(); ++i)
        if (asleep_[i])
            memory.beds.push_back({id[i], rounded[i], weight_[i], pull_[i].cast<float>(), grip_[i], load_[i]});
}

}  // namespace rapid
