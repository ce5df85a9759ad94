// Points at rest, which are left out of the sub-steps until something acts on them anew.
//
// A point falls asleep when it has been still for some time: in each frame of it the point has moved by less than
// solving leaves, a part of what the accelerations on it give a point in a sub-step. From then on it is as immovable to
// the others as a wall, and costs nothing. It wakes, with an effect from the next sub-step on unless said otherwise,
//
//   when another hits it: at once, and with it those that the shock reaches (contacts.h);
//   when what presses it, or pulls it, is no longer what it fell asleep under;
//   when a shape comes or goes, or moves, where it touches it;
//   when a node moves it, gives it a velocity, or changes what it is;
//   when a row that acts on it comes, goes or changes, or what holds it moves.
//
// What rows hold together (islands.h) falls asleep when all of it is still, and wakes at once when any of it wakes. If
// it only hangs, it has to be stiller than what lies, which friction holds: a pendulum is slow where it turns, too.
// What rows hold whose kind does not say that it rests (rows.h) never sleeps.
//
// How long a point has been still is the column `still` (s), and all that decides who sleeps; what a sleeper fell
// asleep under is kept by id from frame to frame, and where it is lost, what is found is taken for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/islands.h"
#include "runtime/vec.h"

namespace rapid {

struct Obstacle;
struct OwnTime;
struct Substep;

// What points fell asleep under.
struct SleepMemory {
    struct Bed {
        std::int64_t id;
        Vec3f P;        // m
        double weight;  // inverse mass, 1/kg
        Vec3f pull;     // m/s²
        float grip;     // of the shapes that it touches
        float load;     // N, the sum of what the others press it by
    };
    std::vector<Bed> beds;
};

class Sleepers {
public:
    // weight: inverse masses, 1/kg; 0 for points that do not move, and so do not sleep. tied: 1 for points that stay
    // awake. after: s.
    Sleepers(PointSet& points, const SleepMemory& memory, std::span<const double> weight,
             std::span<const std::uint8_t> tied, const Islands& islands, double after);

    std::size_t size() const { return asleep_.size(); }
    bool asleep(std::size_t i) const { return flag(i).load(std::memory_order_relaxed) != 0; }
    void wake(std::size_t i)  // from any thread
    {
        flag(i).store(0, std::memory_order_relaxed);
        woken_.store(true, std::memory_order_relaxed);
    }
    double inverse_mass(std::size_t i) const { return weight_[i]; }
    // What a point has fallen asleep under, N: its weight, and what the others press it by.
    double burden(std::size_t i) const { return pull_[i].norm() / weight_[i] + load_[i]; }

    // Before a sub-step: wakes those whose shapes have changed; then counts.
    void begin(const Substep& now, std::span<const Obstacle> obstacles);
    // In this sub-step.
    bool any() const { return count_ > 0; }
    bool all() const { return still_ == size() && !woken_; }  // or stays where it is

    // What the point's own way gives it in this sub-step, m/s² (a velocity, too): a sleeper wakes where that is new.
    void feel(std::size_t i, const Vec3d& pull);

    // In the midst of a sub-step: wakes a sleeper, which goes the way that what pulls it gives it; and all of the
    // islands of which any point has woken, but that a point whose place is given stays there.
    void rouse(std::size_t i, Substep& now);
    void rouse(Substep& now);

    // After the last sub-step: loads are reckoned anew, of those that are awake.
    void unload();
    void keep_awake(std::size_t i) { tied_[i] = 1, wake(i); }  // for this frame
    void load(std::size_t i, double force)                     // N
    {
        if (!asleep_[i]) load_[i] += static_cast<float>(force);
    }
    // Then, with P as it was at the beginning of the frame: who has been still falls asleep.
    void close(Substep& now, std::span<const Vec3f> begin, const OwnTime& lived);
    // After rounding.
    void remember(SleepMemory& memory, const PointSet& points, const Substep& now, std::span<const Obstacle> obstacles);

private:
    std::atomic_ref<std::uint8_t> flag(std::size_t i) const
    {
        return std::atomic_ref<std::uint8_t>(const_cast<std::uint8_t&>(asleep_[i]));
    }
    std::vector<float> grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                             std::span<const Vec3d> P, double time) const;

    void spread(std::size_t island);
    std::vector<std::uint8_t> find_hanging(const Substep& now) const;
    void rest(std::size_t i, Substep& now);

    PointSet& points_;
    std::span<const double> weight_;
    const Islands& islands_;
    std::vector<std::uint8_t> asleep_, tied_;
    std::vector<std::uint8_t> slept_;  // of each island, whether it came to this frame asleep
    std::atomic<bool> woken_ = false;  // somebody, since the beginning of the sub-step
    std::vector<Vec3d> pull_;          // m/s²; NaN where it is not known
    std::vector<float> grip_;          // of the sleepers; NaN where it is not known
    std::vector<float> load_;          // N
    double after_;                     // s
    std::size_t count_ = 0, still_ = 0;
};

}  // namespace rapid
