// Sleep: points at rest are left out of the sub-steps until something acts on them.
//
// A point falls asleep when it has been still for some time: in each frame of it the point has moved by less than the
// error of solving, a part of what the accelerations on it give a point in a sub-step. From then on it has infinite
// mass for the others, and costs nothing. It wakes, with an effect from the next sub-step on unless said otherwise,
//
//   when another hits it: at once, and with it those that the shock reaches (contact_sleep.h);
//   when its load, or the acceleration on it, is no longer what it fell asleep under;
//   when a shape comes or goes, or moves, where it touches it (shape_grip.h);
//   when a node moves it, gives it a velocity, or changes what it is;
//   when a row that acts on it comes, goes or changes, or what holds it moves (row_sleep.h).
//
// Points that rows link (islands.h) fall asleep when all of an island is still, and wake when any of it wakes. If an
// island only hangs, it has to be stiller than one that lies, which friction holds: a pendulum is slow where it turns,
// too. Points of rows whose function does not say that it rests (rows.h) never sleep.
//
// How long a point has been still is the column `still` (s), which alone decides who sleeps. What a sleeper fell asleep
// under is kept by id from frame to frame (sleep_records.h); where it is lost, what is found is taken for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/islands.h"
#include "runtime/solver/constraints/sleep_records.h"
#include "runtime/vec.h"

namespace rapid {

struct Obstacle;
struct OwnTime;
struct Substep;

class Sleep {
public:
    // inverse_mass: 1/kg; 0 for points that do not move, and so do not sleep. after: s.
    Sleep(PointSet& points, std::span<const double> inverse_mass, double after);

    // Before the first sub-step, from constraints:
    void keep_awake(std::size_t i) { kept_awake_[i] = 1, wake(i); }  // in this frame; later, too
    void keep_all_awake();
    void link(std::span<const std::uint32_t> points) { islands_.link(points); }  // by a row that acts between them
    void make_kinematic(std::uint32_t i) { islands_.make_kinematic(i); }         // a point whose position is prescribed
    // Then: who sleeps.
    void open(const SleepRecords& records);

    std::size_t size() const { return asleep_.size(); }
    bool asleep(std::size_t i) const { return flag(i).load(std::memory_order_relaxed) != 0; }
    void wake(std::size_t i)  // from any thread
    {
        flag(i).store(0, std::memory_order_relaxed);
        woken_.store(true, std::memory_order_relaxed);
    }
    double inverse_mass(std::size_t i) const { return inverse_mass_[i]; }
    // What a sleeper fell asleep under, N: its weight, and what the others press it by.
    double burden(std::size_t i) const { return acceleration_[i].norm() / inverse_mass_[i] + load_[i]; }

    // Before a sub-step: wakes those whose shapes have changed; then counts.
    void begin(const Substep& step, std::span<const Obstacle> obstacles);
    // In this sub-step.
    bool any() const { return count_ > 0; }
    bool all() const { return still_ == size() && !woken_; }  // or stays where it is

    // The acceleration of the point's free motion in this sub-step, m/s² (that of a velocity it is given, too): a
    // sleeper wakes where it is another.
    void check_acceleration(std::size_t i, const Vec3d& acceleration);

    // Within a sub-step: wakes a sleeper, which makes up for its free motion; and all of the islands of which any point
    // has woken, but that a kinematic point stays where it is.
    void wake_now(std::size_t i, Substep& step);
    void wake_islands_now(Substep& step);
    std::size_t woken_now() const { return woken_now_; }  // points so far

    // After the last sub-step: loads are summed again, of those that are awake.
    void clear_loads();
    void add_load(std::size_t i, double force)  // N
    {
        if (!asleep_[i]) load_[i] += static_cast<float>(force);
    }
    // Then, with P and v as they were at the beginning of the frame: points that have been still fall asleep.
    void close(Substep& step, std::span<const Vec3f> P, std::span<const Vec3f> v, const OwnTime& lived);
    // After rounding.
    void remember(SleepRecords& records, const Substep& step, std::span<const Obstacle> obstacles);

private:
    std::atomic_ref<std::uint8_t> flag(std::size_t i) const
    {
        return std::atomic_ref<std::uint8_t>(const_cast<std::uint8_t&>(asleep_[i]));
    }
    void wake_island(std::size_t island);
    void count_sleepers(const Substep& step, std::vector<std::uint32_t>& sleepers);
    void wake_by_grips(std::span<const std::uint32_t> sleepers, std::span<const Obstacle> obstacles,
                       std::span<const Vec3d> P);
    void wake_by_motion_of(const Obstacle& obstacle, std::span<const std::uint32_t> sleepers, const Substep& step);
    std::vector<std::uint8_t> find_hanging(const Substep& step) const;
    void put_islands_to_sleep(std::span<float> still, std::span<const Vec3f> v, Substep& step);
    void put_to_sleep(std::size_t i, Substep& step);

    PointSet& points_;
    std::span<const double> inverse_mass_;
    double after_;  // s
    Islands islands_;
    std::vector<std::uint8_t> asleep_, kept_awake_;
    std::vector<std::uint8_t> slept_;             // of each island, whether it came to this frame asleep
    std::atomic<bool> woken_ = false;             // any point, since the beginning of the sub-step
    std::vector<Vec3d> acceleration_;             // m/s²; NaN where it is not known
    std::vector<std::optional<ShapeGrip>> grip_;  // of the sleepers, where it is known
    std::vector<float> load_;                     // N
    std::size_t count_ = 0, still_ = 0, woken_now_ = 0;
};

}  // namespace rapid
