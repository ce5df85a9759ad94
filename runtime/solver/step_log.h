// The events of points within one step: contacts, breaks and deaths, with their times.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

struct LoggedHit {
    std::uint32_t point;    // index in the set before the step
    std::int32_t collider;  // index among those of the chain
    double time;            // s since the start
    Vec3f P, n, vc;         // position, m; the surface's normal, unit, and velocity, m/s
    Vec3f v0, v1;           // the point's velocity before and after, m/s
    float speed;            // of approach, m/s
    float impulse;          // kg m/s
    bool recorded;          // in the hit attributes
};

// One end of a breaking rod or spring.
struct LoggedBreak {
    std::uint32_t point;  // index in the set before the step
    double time;          // s since the start
    Vec3f P, v;           // m, m/s
};

class StepLog {
public:
    explicit StepLog(std::size_t points) : died_at_(points, std::numeric_limits<double>::quiet_NaN()) {}

    // Must be called from the thread that advances the point.
    void add(const LoggedHit& hit) { hits_.local().push_back(hit); }
    void kill(std::size_t point, double time) { died_at_[point] = time; }
    // Must be called from one thread.
    void add(const LoggedBreak& end) { breaks_.push_back(end); }
    // Stores the points with mask 1 in their state at death, before they are removed.
    void take_dead(const PointSet& points, std::span<const std::uint8_t> dead);

    // Returns the hits by point, then by time.
    std::vector<LoggedHit> hits() const;
    const std::vector<LoggedBreak>& breaks() const { return breaks_; }
    const PointSet& dead() const { return dead_; }
    const std::vector<double>& died_at() const { return dead_times_; }

private:
    tbb::enumerable_thread_specific<std::vector<LoggedHit>> hits_;
    std::vector<LoggedBreak> breaks_;
    std::vector<double> died_at_;  // by point; NaN for living points
    PointSet dead_;
    std::vector<double> dead_times_;
};

}  // namespace rapid
