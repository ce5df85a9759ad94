// Splits polygons into triangles.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

// Cuts ears off a polygon: corners that turn left and whose triangle with their two neighbours contains no other
// corner.
//
// If a corner's triangle contains another corner, it waits until that corner is cut off; only cutting a neighbour can
// make it an ear earlier. Each of at most 3 n triangles therefore tests each corner once, and a tree of boxes around
// nearby corners skips most of the tests. This takes n log n for typical polygons and n^2 at worst, limited to
// `max_looks` n.
class PolygonCutter {
public:
    static constexpr std::size_t max_corners = 1 << 20, max_looks = 1024;

    // Appends the triangles of a polygon with three or more corners, starting at its second corner, so that a convex
    // polygon becomes a fan about its first. It need not be convex or exactly flat. The rest of a self-intersecting
    // polygon becomes a fan. The corners index `positions`. Returns false if the polygon exceeds max_corners or takes
    // more than max_looks per corner.
    bool append(std::span<const Vec3f> positions, std::span<const std::int32_t> corners,
                std::vector<Mesh::Triangle>& triangles);

private:
    static constexpr std::int32_t none = -1;
    static constexpr std::int32_t leaf = 8;  // corners per leaf box

    struct Corner {
        Eigen::Vector2d P;  // in the plane of the polygon
        std::int32_t before, after;
        std::int32_t index = 0;      // index in order_
        std::int32_t look_from = 0;  // corners before this index in order_ are not in the triangle
        bool left = true, ready = true;
        std::int32_t first_waiting = none;  // head of the list of corners that wait for this one to be cut off
        std::int32_t waits_for = none, previous = none, next = none;  // links of the list that this corner waits in
    };
    struct Box {
        Eigen::AlignedBox2d box;
        std::int32_t left = 0;  // remaining corners
    };
    struct Ear {
        std::int32_t before, at, after;
        Eigen::AlignedBox2d box;
    };

    bool flatten(std::span<const Vec3f> positions, std::span<const std::int32_t> corners);
    void fill_boxes();
    double turn(std::int32_t a, std::int32_t b, std::int32_t c) const;
    bool is_in(std::int32_t corner, const Ear& ear) const;
    bool meets(const Eigen::AlignedBox2d& box, const Ear& ear) const;
    void split(std::int32_t begin, std::int32_t end);
    std::int32_t first_in(const Ear& ear, std::int32_t from, std::int32_t node, std::int32_t begin, std::int32_t end);
    bool is_ear(std::int32_t corner);
    void wait(std::int32_t corner, std::int32_t for_which);
    void stop_waiting(std::int32_t corner);
    void make_ready(std::int32_t corner);
    void cut_off(std::int32_t corner);
    std::int32_t take_ready();

    std::vector<Corner> corners_;
    std::vector<std::int32_t> order_;  // corners sorted so that those in a box are near each other
    std::vector<Box> boxes_;           // a binary tree: the children of [k] are [2 k] and [2 k + 1]
    std::int32_t first_leaf_ = 1;      // in boxes_
    std::vector<std::int32_t> ready_;  // heap of corners that may be ears, lowest index on top
    std::size_t looks_ = 0;
};

}  // namespace rapid
