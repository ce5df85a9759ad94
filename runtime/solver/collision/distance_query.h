// Points whose distance from one shape is queried in one call.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/shapes/shape.h"

namespace rapid {

struct DistanceQuery {
    std::vector<std::uint32_t> point;  // the caller's index, mostly in the block
    std::vector<Vec3d> P;              // m
    std::vector<double> time;          // s since the beginning of the frame; empty if points are added without it

    // The results; gradients are not normalised, and zero if none exists.
    std::vector<double> phi;  // m
    std::vector<Vec3d> gradient;

    std::size_t size() const { return point.size(); }
    bool empty() const { return point.empty(); }

    void clear()
    {
        point.clear();
        P.clear();
        time.clear();
    }
    void add(std::size_t i, const Vec3d& at)
    {
        point.push_back(static_cast<std::uint32_t>(i));
        P.push_back(at);
    }
    void add(std::size_t i, const Vec3d& at, double when)
    {
        add(i, at);
        time.push_back(when);
    }

    // Keep a few of the queries: move() moves entry `from` to index `to`, truncate() drops those from `count` on.
    void move(std::size_t from, std::size_t to)
    {
        point[to] = point[from];
        P[to] = P[from];
        time[to] = time[from];
    }
    void truncate(std::size_t count)
    {
        point.resize(count);
        P.resize(count);
        time.resize(count);
    }

    // Find values at the end of the frame.
    void find_distances(const Shape& shape)
    {
        phi.resize(size());
        shape.distance(P, phi, {});
    }
    void find_gradients(const Shape& shape)
    {
        phi.resize(size());
        gradient.resize(size());
        shape.distance(P, phi, gradient);
    }

    // Find values with each point at its own time.
    void find_distances_at_times(const Shape& shape)
    {
        phi.resize(size());
        shape.distance_at(P, time, phi, {});
    }
    void find_gradients_at_times(const Shape& shape)
    {
        phi.resize(size());
        gradient.resize(size());
        shape.distance_at(P, time, phi, gradient);
    }
};

}  // namespace rapid
