// Points whose distance from one shape is asked for in one call.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/shapes/shape.h"

namespace rapid {

struct DistanceQuery {
    std::vector<std::uint32_t> point;  // as the caller counts them, mostly in the block
    std::vector<Vec3d> P;              // m
    std::vector<double> time;          // s since the beginning of the frame; empty where points are added without it

    // The answers; gradients are not normalised, and zero where there is none.
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

    // Keeps a few of the questions: moves question `from` to place `to`, then drops those from `count` on.
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

    // At the end of the frame.
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

    // Each point at its own time.
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
