// Polygons as triangles.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

// Cuts ears off a polygon: corners that turn left and whose triangle, with the two neighbours, holds no other corner.
//
// A corner in whose triangle another one is waits until that one is cut off: until then nothing but a neighbour that is
// cut off makes it an ear. So each of at most 3 n triangles looks at each corner once, and boxes around neighbouring
// corners leave out most of these: n log n for polygons as they are drawn, n^2 at worst, of which no more than
// `most_looks` n are taken.
class PolygonCutter {
public:
    static constexpr std::size_t most_corners = 1 << 20, most_looks = 1024;

    // The triangles of a polygon of three corners or more, from its second corner on: a convex one becomes a fan about
    // its first. It need not be convex, nor quite flat; what is left of one that crosses itself is a fan. The corners
    // index `positions`. False: it has more than the most corners, or takes more than the most looks.
    bool append(std::span<const Vec3f> positions, std::span<const std::int32_t> corners,
                std::vector<Mesh::Triangle>& triangles);

private:
    static constexpr std::int32_t none = -1;
    static constexpr std::int32_t leaf = 8;  // corners below a box that has no others below it

    struct Corner {
        Eigen::Vector2d P;  // in the plane of the polygon
        std::int32_t before, after;
        std::int32_t place = 0;      // in order_
        std::int32_t look_from = 0;  // corners at places before it are not in the triangle
        bool left = true, ready = true;
        std::int32_t first_waiting = none;                            // for this one to be cut off
        std::int32_t waits_for = none, previous = none, next = none;  // in the list of that one
    };
    struct Box {
        Eigen::AlignedBox2d box;
        std::int32_t left = 0;  // corners
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
    std::vector<std::int32_t> order_;  // corners by place: those below a box are near each other
    std::vector<Box> boxes_;           // of a binary tree: those below [k] are [2 k] and [2 k + 1]
    std::int32_t first_leaf_ = 1;      // in boxes_
    std::vector<std::int32_t> ready_;  // corners that may be ears, a heap with the first on top
    std::size_t looks_ = 0;
};

}  // namespace rapid
