#include "runtime/solver/constraints/sleep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/base/parallel.h"
#include "runtime/points/id_index.h"
#include "runtime/solver/collision/collisions.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/shape_contacts.h"
#include "runtime/solver/constraints/spin.h"
#include "runtime/solver/motion/ballistic_batch.h"

namespace rapid {

void Islands::link(std::span<const std::uint32_t> points)
{
    if (!sets_) sets_.emplace(weight_.size()), linked_.resize(weight_.size());
    const std::uint32_t* first = nullptr;
    for (const std::uint32_t& i : points) {
        if (!(weight_[i] > 0)) continue;
        linked_[i] = 1;
        if (!first) first = &i;
        sets_->join(*first, i);
    }
}

void Islands::make_kinematic(std::uint32_t i)
{
    if (!(weight_[i] > 0)) return;
    link({&i, 1});
    kinematic_.resize(weight_.size());
    kinematic_[i] = 1;
}

void Islands::close()
{
    if (!sets_) return;
    std::vector<std::uint32_t> island(linked_.size()), count;
    for (std::uint32_t i = 0; i < linked_.size(); ++i) {
        if (!linked_[i]) continue;
        const std::uint32_t root = sets_->root(i);  // lowest index of its island
        if (root == i) island[i] = static_cast<std::uint32_t>(count.size()), count.push_back(0);
        island[i] = island[root];
        ++count[island[i]];
    }
    begin_.assign(1, 0);
    for (const std::uint32_t size : count) begin_.push_back(begin_.back() + size);
    points_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t i = 0; i < linked_.size(); ++i)
        if (linked_[i]) points_[next[island[i]]++] = i;
}

namespace {

// A point is still if its mean speed in a frame and its speed at the end are below these fractions of the speed that
// accelerations give it in a substep (0.03 m/s at 12 substeps of 24 frames a second). Solving leaves 0.03 of it in a
// heap of 10,000 grains a second after the heap has stopped. Larger values would hold a slope that still slides;
// smaller values are reached much later.
constexpr double still_shift = 0.05, still_speed = 0.25;

// A hanging island is still if, in the time that it takes to fall asleep, it gains at most this fraction of the speed
// that accelerations would give it. A pendulum with a deflection of 2e-4 of its length thus stays awake with any
// number of substeps.
constexpr double still_hanging = 1e-4;

// The limit for points that nothing presses or holds, which come to rest exactly or slide, relative to the speed that
// accelerations give them in a substep. Above rounding, so that a point that drag slows down forever also falls
// asleep.
constexpr double still_alone = 1e-6;

// The relative change of an acceleration that does not wake: friction may only just have held the point.
constexpr double same_acceleration = 1e-3;

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

// A point that gains speed in a frame is not held by friction, however slow it is. It falls asleep once it no longer
// gains speed.
float just_before(double after) { return std::nextafter(static_cast<float>(after), 0.0f); }

}  // namespace

void Coupling::join(Sleep* sleep)
{
    if (sleep) sleep->keep_all_awake();
}

Sleep::Sleep(PointSet& points, std::span<const double> inverse_mass, double after)
    : points_(points),
      inverse_mass_(inverse_mass),
      after_(after),
      islands_(inverse_mass),
      asleep_(points.size()),
      kept_awake_(points.size()),
      acceleration_(points.size(), Vec3d::Constant(unknown)),
      grip_(points.size()),
      load_(points.size(), 0.0f)
{
}

void Sleep::keep_all_awake() { std::fill(kept_awake_.begin(), kept_awake_.end(), std::uint8_t{1}); }

void Sleep::open(const SleepRecords& records)
{
    woken_ = false;
    islands_.close();
    const PointSet& points = points_;
    const Strided<float> still = points.column<float>("still").read();
    const Strided<Vec3f> P = points.P().read(), v = points.v().read();
    for (std::size_t i = 0; i < asleep_.size(); ++i)
        asleep_[i] = still[i] >= after_ && inverse_mass_[i] > 0 && !kept_awake_[i] && v[i].isZero(0);
    for (std::size_t k = 0; k < islands_.size(); ++k) {
        const std::span<const std::uint32_t> island = islands_[k];
        slept_.push_back(
            std::all_of(island.begin(), island.end(), [&](std::uint32_t i) { return still[i] >= after_; }));
    }
    const IdIndex index(points.id());
    for (const SleepRecords::Record& record : records.records) {
        const std::uint32_t i = index[record.id];
        if (i == IdIndex::none) continue;
        if (P[i] != record.P || inverse_mass_[i] != record.inverse_mass) asleep_[i] = 0;
        acceleration_[i] = record.acceleration.cast<double>();
        grip_[i] = record.grip;
        load_[i] = record.load;
    }
    for (std::size_t k = 0; k < islands_.size(); ++k) wake_island(k);
}

// Unless the whole island sleeps.
void Sleep::wake_island(std::size_t k)
{
    const std::span<const std::uint32_t> island = islands_[k];
    if (std::all_of(island.begin(), island.end(), [&](std::uint32_t i) { return asleep_[i] != 0; })) return;
    for (const std::uint32_t i : island) asleep_[i] = 0;
}

void Sleep::wake_islands_now(Substep& step)
{
    if (!woken_) return;
    for (std::size_t k = 0; k < islands_.size(); ++k) {
        const std::span<const std::uint32_t> island = islands_[k];
        wake_island(k);
        if (asleep_[island.front()]) continue;
        for (const std::uint32_t i : island)
            if (!(step.points[i].w > 0)) wake_now(i, step);
    }
}

void Sleep::wake_now(std::size_t i, Substep& step)
{
    wake(i);
    if (islands_.is_kinematic(i)) return;
    ++woken_now_;
    const Mobility mobility = step.mobility_of(i);
    step.points[i].w = inverse_mass_[i] * mobility.v / step.dt;
    step.points[i].P += mobility.x * acceleration_[i];
    step.v[i] += mobility.v * acceleration_[i];
    if (!step.displacement.empty()) step.displacement[i] = mobility.x * acceleration_[i];
}

void Sleep::count_sleepers(const Substep& step, std::vector<std::uint32_t>& sleepers)
{
    sleepers.clear();
    for (std::size_t i = 0; i < asleep_.size(); ++i)
        if (asleep_[i]) sleepers.push_back(static_cast<std::uint32_t>(i));
    count_ = still_ = sleepers.size();
    for (std::size_t i = 0; i < asleep_.size(); ++i)
        still_ += !(inverse_mass_[i] > 0) && !kept_awake_[i] && step.v[i].isZero(0);
}

void Sleep::begin(const Substep& step, std::span<const Obstacle> obstacles)
{
    std::vector<std::uint32_t> sleepers;
    count_sleepers(step, sleepers);
    if (sleepers.empty()) {
        woken_ = false;
        return;
    }
    if (step.index == 0) {
        std::vector<Vec3d> P(asleep_.size());
        for (const std::uint32_t i : sleepers) P[i] = step.points[i].P;
        wake_by_grips(sleepers, obstacles, P);
    }
    for (const Obstacle& obstacle : obstacles)
        if (obstacle.moves) wake_by_motion_of(obstacle, sleepers, step);
    for (std::size_t k = 0; woken_ && k < islands_.size(); ++k) wake_island(k);
    woken_ = false;
    count_sleepers(step, sleepers);
}

// Wakes points whose shapes have changed since they fell asleep.
void Sleep::wake_by_grips(std::span<const std::uint32_t> sleepers, std::span<const Obstacle> obstacles,
                          std::span<const Vec3d> P)
{
    const std::vector<ShapeGrip> found = shape_grips(sleepers, obstacles, P, 0);
    for (std::size_t k = 0; k < sleepers.size(); ++k) {
        std::optional<ShapeGrip>& known = grip_[sleepers[k]];
        if (!known) known = found[k];
        if (!known->is_like(found[k])) wake(sleepers[k]);
    }
}

// Wakes points that the shape touches, or may touch in the next substep, if it moves faster than a still point.
void Sleep::wake_by_motion_of(const Obstacle& obstacle, std::span<const std::uint32_t> sleepers, const Substep& step)
{
    const double end = (step.index + 1) * step.dt;
    for_each_chunk(sleepers.size(), [&](std::size_t first, std::size_t last) {
        std::vector<double> phi(1), time(1, end);
        for (std::size_t k = first; k < last; ++k) {
            const std::uint32_t i = sleepers[k];
            const Vec3d P = step.points[i].P;
            if (!obstacle.members[i]) continue;
            const double speed = obstacle.shape->velocity_at(P, end).norm();
            const double reach = (1 + touch) * obstacle.radius[i] + 2 * step.dt * speed;
            if (speed < still_shift * step.dt * acceleration_[i].norm() ||
                obstacle.bounds.squaredExteriorDistance(P) > reach * reach)
                continue;
            obstacle.shape->distance_at({&P, 1}, time, phi, {});
            if (phi[0] <= reach) wake(i);
        }
    });
}

void Sleep::check_acceleration(std::size_t i, const Vec3d& acceleration)
{
    const bool known = acceleration_[i].allFinite();
    if (asleep_[i] && known && (acceleration - acceleration_[i]).norm() > same_acceleration * acceleration_[i].norm())
        wake(i);
    if (!asleep_[i] || !known) acceleration_[i] = acceleration;
}

void Sleep::clear_loads()
{
    for (std::size_t i = 0; i < asleep_.size(); ++i)
        if (!asleep_[i]) load_[i] = 0;
}

// Marks the points of islands in which nothing lies on a shape or on another point.
std::vector<std::uint8_t> Sleep::find_hanging(const Substep& step) const
{
    std::vector<std::uint8_t> hangs(islands_.size() > 0 ? asleep_.size() : 0);
    for (std::size_t k = 0; k < islands_.size() && !step.next_support.empty(); ++k) {
        const std::span<const std::uint32_t> island = islands_[k];
        if (std::none_of(island.begin(), island.end(),
                         [&](std::uint32_t i) { return load_[i] > 0 || step.next_support[i] > 0; }))
            for (const std::uint32_t i : island) hangs[i] = 1;
    }
    return hangs;
}

void Sleep::close(Substep& step, std::span<const Vec3f> P, std::span<const Vec3f> v, const OwnTime& lived)
{
    const auto h = static_cast<float>(lived.h);
    const std::span<float> still = points_.column<float>("still").write();
    const double gained = step.max_acceleration * step.dt;  // m/s, in a substep
    const double hanging = still_hanging * step.max_acceleration * after_;
    for (std::size_t k = 0; k < islands_.size(); ++k) wake_island(k);
    const std::vector<std::uint8_t> hangs = find_hanging(step);
    for_each_chunk(asleep_.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            if (asleep_[i]) continue;
            const bool linked = islands_.has(i);
            const bool alone = !linked && !(load_[i] > 0);
            const double most = linked && hangs[i] ? hanging
                                : alone            ? still_alone * gained
                                                   : std::numeric_limits<double>::infinity();
            const double shift = (step.points[i].P - P[i].cast<double>()).norm();
            const bool is_still =
                inverse_mass_[i] > 0 && !kept_awake_[i] && step.lives(i) && !(lived(i) < lived.h) && gained > 0 &&
                shift <= std::min(still_shift * gained, most) * lived.h &&
                step.v[i].norm() <= std::min(still_speed * gained, most) &&
                (step.spins.empty() || step.spins[i].s.norm() <= std::min(still_speed * gained, most));
            // A woken sleeper starts at 0.
            still[i] = is_still && (linked || still[i] < after_) ? still[i] + h : 0;
            if (linked || still[i] < after_) continue;
            if (step.v[i].cast<float>().squaredNorm() > v[i].squaredNorm())
                still[i] = just_before(after_);
            else
                put_to_sleep(i, step);
        }
    });
    put_islands_to_sleep(still, v, step);
}

void Sleep::put_islands_to_sleep(std::span<float> still, std::span<const Vec3f> v, Substep& step)
{
    for (std::size_t k = 0; k < islands_.size(); ++k) {
        const std::span<const std::uint32_t> island = islands_[k];
        if (asleep_[island.front()]) continue;
        if (slept_[k])
            for (const std::uint32_t i : island) still[i] = 0;
        if (!std::all_of(island.begin(), island.end(), [&](std::uint32_t i) { return still[i] >= after_; })) continue;
        double gained = 0;  // J, in this frame
        for (const std::uint32_t i : island)
            if (inverse_mass_[i] > 0)
                gained += (step.v[i].cast<float>().squaredNorm() - v[i].squaredNorm()) / inverse_mass_[i];
        for (const std::uint32_t i : island) {
            if (gained > 0)
                still[i] = just_before(after_);
            else
                put_to_sleep(i, step);
        }
    }
}

void Sleep::put_to_sleep(std::size_t i, Substep& step)
{
    asleep_[i] = 1;
    grip_[i].reset();
    step.v[i].setZero();
    if (!step.spins.empty()) step.spins[i].s.setZero();
}

void Sleep::remember(SleepRecords& records, const Substep& step, std::span<const Obstacle> obstacles)
{
    std::vector<std::uint32_t> fresh;
    std::vector<Vec3d> P(asleep_.size());
    const PointSet& points = points_;
    const Strided<Vec3f> rounded = points.P().read();
    for (std::size_t i = 0; i < asleep_.size(); ++i) {
        if (!asleep_[i]) continue;
        P[i] = rounded[i].cast<double>();
        if (!grip_[i]) fresh.push_back(static_cast<std::uint32_t>(i));
    }
    const std::vector<ShapeGrip> found = shape_grips(fresh, obstacles, P, (step.index + 1) * step.dt);
    for (std::size_t k = 0; k < fresh.size(); ++k) grip_[fresh[k]] = found[k];
    records.records.clear();
    const Strided<std::int64_t> id = points.id().read();
    for (std::size_t i = 0; i < asleep_.size(); ++i)
        if (asleep_[i])
            records.records.push_back(
                {id[i], rounded[i], inverse_mass_[i], acceleration_[i].cast<float>(), *grip_[i], load_[i]});
}

}  // namespace rapid
