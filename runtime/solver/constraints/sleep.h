// Sleep: points at rest are skipped in substeps until something acts on them.
//
// A point falls asleep after a period of stillness: in each frame of it, the point has moved by less than the solver's
// error, a fraction of the motion that accelerations cause in a substep. It then has infinite mass for the others and
// costs nothing. It wakes, with effect from the next substep unless stated otherwise,
//
//   when another point hits it: immediately, and with it those that the shock reaches (contacts.h);
//   when its load, or the acceleration on it, differs from the one with which it fell asleep;
//   when a shape that touches it is added, removed or moved (shape_contacts.h);
//   when a node moves it, gives it a velocity, or changes its properties;
//   when a row that acts on it is added, removed or changed, or its anchor moves (rows.h).
//
// Points that rows link (Islands) fall asleep when the whole island is still, and wake when any of it wakes. An
// island that hangs must be stiller than one that lies and is held by friction, because a pendulum is also slow at its
// turning points. Points of rows whose function does not declare `rests` (rows.h) never sleep.
//
// The column `still` (s) holds how long a point has been still, and alone decides which points sleep. The conditions
// under which a point fell asleep are stored by id between frames (SleepRecords); if they are lost, the current
// ones are used.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/disjoint_sets.h"
#include "runtime/solver/constraints/shape_contacts.h"

namespace rapid {

// The conditions under which sleeping points fell asleep, stored between frames.
struct SleepRecords {
    struct Record {
        std::int64_t id;
        Vec3f P;              // m
        double inverse_mass;  // 1/kg
        Vec3f acceleration;   // m/s²
        ShapeGrip grip;       // of the shapes that it touches
        float load;           // N, the total pressure of other points
    };
    std::vector<Record> records;
};

// Islands: points that fall asleep and wake together, because rows carry forces between them.
class Islands {
public:
    // weight: inverse masses. A point of infinite mass separates the points linked to it, like a wall.
    explicit Islands(std::span<const double> weight) : weight_(weight) {}

    // Links points that a row acts between.
    void link(std::span<const std::uint32_t> points);
    // Makes a point kinematic: it belongs to an island, but no row moves it.
    void make_kinematic(std::uint32_t i);
    // Numbers the islands in the order of their first points.
    void close();

    std::size_t size() const { return begin_.size() - 1; }
    std::span<const std::uint32_t> operator[](std::size_t island) const  // ascending
    {
        return std::span(points_).subspan(begin_[island], begin_[island + 1] - begin_[island]);
    }
    bool has(std::size_t i) const { return !linked_.empty() && linked_[i]; }
    bool is_kinematic(std::size_t i) const { return !kinematic_.empty() && kinematic_[i]; }

private:
    std::span<const double> weight_;
    std::optional<DisjointSets> sets_;              // set after points are linked
    std::vector<std::uint8_t> linked_, kinematic_;  // empty if no point is
    std::vector<std::uint32_t> begin_{0}, points_;
};

struct Obstacle;
struct OwnTime;
struct Substep;

class Sleep {
public:
    // inverse_mass: 1/kg; 0 for points that do not move and thus do not sleep. after: s.
    Sleep(PointSet& points, std::span<const double> inverse_mass, double after);

    // Before the first substep, from constraints:
    void keep_awake(std::size_t i) { kept_awake_[i] = 1, wake(i); }  // in this frame; may be called later, too
    void keep_all_awake();
    void link(std::span<const std::uint32_t> points) { islands_.link(points); }  // by a row between them
    void make_kinematic(std::uint32_t i) { islands_.make_kinematic(i); }         // has a prescribed position
    // Determines which points sleep, after the calls above.
    void open(const SleepRecords& records);

    std::size_t size() const { return asleep_.size(); }
    bool asleep(std::size_t i) const { return flag(i).load(std::memory_order_relaxed) != 0; }
    void wake(std::size_t i)  // from any thread
    {
        flag(i).store(0, std::memory_order_relaxed);
        woken_.store(true, std::memory_order_relaxed);
    }
    double inverse_mass(std::size_t i) const { return inverse_mass_[i]; }
    // The force under which a sleeper fell asleep, N: its weight plus the pressure of others.
    double burden(std::size_t i) const { return acceleration_[i].norm() / inverse_mass_[i] + load_[i]; }

    // Is called before a substep. Wakes points whose shapes have changed, then counts the sleepers.
    void begin(const Substep& step, std::span<const Obstacle> obstacles);
    // In this substep.
    bool any() const { return count_ > 0; }
    bool all() const { return still_ == size() && !woken_; }  // and stays in place

    // Wakes a sleeper if the acceleration of its free motion in this substep, m/s², has changed. An assigned velocity
    // counts as an acceleration.
    void check_acceleration(std::size_t i, const Vec3d& acceleration);

    // Wakes a sleeper within a substep and makes up for its free motion; then wakes all islands with any woken point,
    // except that kinematic points stay in place.
    void wake_now(std::size_t i, Substep& step);
    void wake_islands_now(Substep& step);
    std::size_t woken_now() const { return woken_now_; }  // points so far

    // Is called after the last substep. Loads are summed again, for points that are awake.
    void clear_loads();
    void add_load(std::size_t i, double force)  // N
    {
        if (!asleep_[i]) load_[i] += static_cast<float>(force);
    }
    // Then puts points that have been still to sleep, with P and v as at the beginning of the frame.
    void close(Substep& step, std::span<const Vec3f> P, std::span<const Vec3f> v, const OwnTime& lived);
    // Stores the sleep records, after rounding.
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
    std::vector<std::uint8_t> slept_;             // by island: whether it was asleep at the start of this frame
    std::atomic<bool> woken_ = false;             // any point, since the beginning of the substep
    std::vector<Vec3d> acceleration_;             // m/s²; NaN if unknown
    std::vector<std::optional<ShapeGrip>> grip_;  // of the sleepers, if known
    std::vector<float> load_;                     // N
    std::size_t count_ = 0, still_ = 0, woken_now_ = 0;
};

}  // namespace rapid
