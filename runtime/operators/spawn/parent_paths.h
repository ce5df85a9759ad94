// The paths of points through a step, along which others are born.
//
// Between the states before and after the step, and at contacts within it, a point is on the cubic Hermite curve
//
//   P(u) = P0 + u (T v0 + u (3d - T (2 v0 + v1) + u (T (v0 + v1) - 2d)))       u from 0 to 1 in the time T, d = P1 - P0
//
// which is its exact path if its acceleration is linear in time, e.g. a parabola between two bounces.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "runtime/graph/simulation.h"

namespace rapid {

class ParentPaths {
public:
    static constexpr std::uint32_t none = UINT32_MAX;

    // Times are in s since the beginning of the step.
    struct Parent {
        const PointSet* set;  // has the parent's values
        std::uint32_t index;  // in set
        std::int64_t id;
        std::uint32_t before;   // index in the record's `before`; none if it did not exist then
        double begin, end;      // of its life in this step
        double path_end;        // time at which it has the position in the set
        std::uint32_t hit = 0;  // its hits in the record: index of the first, and number
        std::uint32_t hits = 0;
        bool takes_part = true;  // belongs to the group
        bool is_alive = true;
        bool is_new = false;  // born in this step
    };

    struct Moment {
        Vec3d P, v;  // m, m/s
    };

    // The curve of a parent between two consecutive states.
    struct Piece {
        double begin, end;  // s
        Vec3d c0, c1, c2, c3;
        Vec3d v;  // for a piece of zero length

        bool holds(double t) const { return begin <= t && t < end; }
        Moment at(double t) const
        {
            const double T = end - begin;
            if (!(T > 0)) return {c0, v};
            const double u = (t - begin) / T;
            return {c0 + u * (c1 + u * (c2 + u * c3)), (c1 + u * (2 * c2 + u * (3 * c3))) / T};
        }
    };

    // living: the points after the step; the points of the record that died in it follow. Both must outlive this.
    ParentPaths(const PointSet& living, const StepRecord& record, const std::string& group);

    std::size_t size() const { return parents_.size(); }
    const Parent& operator[](std::size_t i) const { return parents_[i]; }
    std::int64_t id(const Parent& parent) const { return parent.id; }
    const StepRecord& record() const { return record_; }
    const PointSet& living() const { return living_; }
    double time_of(const LoggedHit& hit) const { return hit.time - (record_.time - record_.h); }

    // Returns the piece of the path at a time. May be called from any thread.
    Piece piece(const Parent& parent, double t) const;
    Moment at(const Parent& parent, double t) const { return piece(parent, t).at(t); }

    // Number of points that did not exist before the step and keep one position throughout it.
    std::size_t without_path() const { return without_path_; }

private:
    // The columns of a set, looked up once.
    struct States {
        explicit States(const PointSet& set) : P(set.P().read()), v(set.v().read()) {}
        Strided<Vec3f> P, v;

        Moment at(std::size_t i) const { return {P[i].cast<double>(), v[i].cast<double>()}; }
    };

    void add(const PointSet& set, std::span<const double> died_at, bool moved_on, const std::string& group);
    void take_hits();
    const States& states_of(const Parent& parent) const
    {
        return parent.set == &living_ ? living_states_ : parent.set == &record_.killed ? killed_states_ : old_states_;
    }

    const PointSet& living_;
    const StepRecord& record_;
    const States living_states_, killed_states_, old_states_, before_;
    std::vector<Parent> parents_;
    std::size_t without_path_ = 0;
};

}  // namespace rapid
