#include "runtime/shapes/mesh/polygon.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace rapid {
namespace {

// Returns twice the area, along the direction from which the corners are counter-clockwise (Newell).
Vec3d normal_of(std::span<const Vec3f> positions, std::span<const std::int32_t> corners)
{
    Vec3d normal = Vec3d::Zero();
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3d a = positions[corners[i]].cast<double>();
        const Vec3d b = positions[corners[(i + 1) % corners.size()]].cast<double>();
        normal += a.cross(b);
    }
    return normal;
}

// Returns true for a convex quad, the most common polygon. If all four corners turn left, none is in the triangle of
// the others.
bool is_convex_quad(std::span<const Vec3f> positions, std::span<const std::int32_t> corners)
{
    if (corners.size() != 4) return false;
    const auto P = [&](int k) { return positions[corners[k % 4]].cast<double>().eval(); };
    const Vec3d normal = (P(2) - P(0)).cross(P(3) - P(1));
    for (int k = 0; k < 4; ++k)
        if (!(normal.dot((P(k + 1) - P(k)).cross(P(k + 2) - P(k + 1))) > 0)) return false;
    return true;
}

}  // namespace

// Projects the corners to the plane, counter-clockwise. Returns false if the area is 0 or not finite.
bool PolygonCutter::flatten(std::span<const Vec3f> positions, std::span<const std::int32_t> corners)
{
    const Vec3d normal = normal_of(positions, corners);
    const double size = normal.norm();
    if (!(size > 0 && std::isfinite(size))) return false;
    // If the normal is along an axis, the plane's axes are too, and coordinates are exactly those of the file.
    int least;
    normal.cwiseAbs().minCoeff(&least);
    const Vec3d x = Vec3d::Unit(least).cross(normal / size).normalized(), y = (normal / size).cross(x);
    const auto n = static_cast<std::int32_t>(corners.size());
    corners_.resize(corners.size());
    for (std::int32_t i = 0; i < n; ++i) {
        const Vec3d P = positions[corners[i]].cast<double>();
        corners_[i] = {.P = {x.dot(P), y.dot(P)}, .before = i == 0 ? n - 1 : i - 1, .after = i + 1 == n ? 0 : i + 1};
    }
    return true;
}

// Sorts the range [begin, end) of order_ so that the corners in each box of the tree are near each other.
void PolygonCutter::split(std::int32_t begin, std::int32_t end)
{
    if (end - begin == leaf) return;
    const std::int32_t middle = begin + (end - begin) / 2,
                       last = std::min(end, static_cast<std::int32_t>(order_.size()));
    if (middle >= last) return split(begin, middle);
    Eigen::AlignedBox2d box;
    for (std::int32_t k = begin; k < last; ++k) box.extend(corners_[order_[k]].P);
    const int axis = box.sizes().x() < box.sizes().y();
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + last,
                     [&](std::int32_t a, std::int32_t b) { return corners_[a].P[axis] < corners_[b].P[axis]; });
    split(begin, middle);
    split(middle, end);
}

void PolygonCutter::fill_boxes()
{
    const auto n = static_cast<std::int32_t>(corners_.size());
    first_leaf_ = 1;
    while (first_leaf_ * leaf < n) first_leaf_ *= 2;
    order_.resize(corners_.size());
    std::iota(order_.begin(), order_.end(), 0);
    split(0, first_leaf_ * leaf);
    boxes_.assign(2 * static_cast<std::size_t>(first_leaf_), Box());
    for (std::int32_t index = 0; index < n; ++index) {
        Box& box = boxes_[first_leaf_ + index / leaf];
        box.box.extend(corners_[order_[index]].P);
        ++box.left;
        corners_[order_[index]].index = index;
    }
    for (std::int32_t k = first_leaf_ - 1; k > 0; --k)
        boxes_[k] = {boxes_[2 * k].box.merged(boxes_[2 * k + 1].box), boxes_[2 * k].left + boxes_[2 * k + 1].left};
}

// Returns twice the area of a triangle, positive if it is counter-clockwise.
double PolygonCutter::turn(std::int32_t a, std::int32_t b, std::int32_t c) const
{
    const Eigen::Vector2d p = corners_[b].P - corners_[a].P, q = corners_[c].P - corners_[a].P;
    return p.x() * q.y() - p.y() * q.x();
}

bool PolygonCutter::is_in(std::int32_t corner, const Ear& ear) const
{
    const auto& [before, at, after, box] = ear;
    if (!corners_[corner].left || corner == before || corner == at || corner == after) return false;
    const Eigen::Vector2d& P = corners_[corner].P;
    if (!box.contains(P) || P == corners_[before].P || P == corners_[at].P || P == corners_[after].P) return false;
    return turn(before, at, corner) >= 0 && turn(at, after, corner) >= 0 && turn(after, before, corner) >= 0;
}

// Returns false if the box is completely to the right of an edge of the triangle, or does not meet its bounding box.
bool PolygonCutter::meets(const Eigen::AlignedBox2d& box, const Ear& ear) const
{
    if (!box.intersects(ear.box)) return false;
    const auto is_left = [&](std::int32_t a, std::int32_t b) {
        const Eigen::Vector2d &P = corners_[a].P, d = corners_[b].P - P;
        const Eigen::Vector2d leftmost(d.y() > 0 ? box.min().x() : box.max().x(),
                                       d.x() > 0 ? box.max().y() : box.min().y());
        return d.x() * (leftmost.y() - P.y()) - d.y() * (leftmost.x() - P.x()) >= 0;
    };
    return is_left(ear.before, ear.at) && is_left(ear.at, ear.after) && is_left(ear.after, ear.before);
}

// Returns the first index, at least `from`, of a corner in the triangle. [begin, end) is the range of the box `node`.
std::int32_t PolygonCutter::first_in(const Ear& ear, std::int32_t from, std::int32_t node, std::int32_t begin,
                                     std::int32_t end)
{
    ++looks_;
    if (end <= from || boxes_[node].left == 0 || !meets(boxes_[node].box, ear)) return none;
    if (node < first_leaf_) {
        const std::int32_t middle = begin + (end - begin) / 2;
        const std::int32_t found = first_in(ear, from, 2 * node, begin, middle);
        return found != none ? found : first_in(ear, from, 2 * node + 1, middle, end);
    }
    const std::int32_t last = std::min(end, static_cast<std::int32_t>(corners_.size()));
    for (std::int32_t index = std::max(begin, from); index < last; ++index) {
        ++looks_;
        if (is_in(order_[index], ear)) return index;
    }
    return none;
}

// Returns true if the corner is an ear. Otherwise makes it wait, for a corner that lies in its triangle or for a
// neighbour.
bool PolygonCutter::is_ear(std::int32_t corner)
{
    Corner& at = corners_[corner];
    if (!(turn(at.before, corner, at.after) > 0)) return false;
    Ear ear{at.before, corner, at.after, Eigen::AlignedBox2d(at.P)};
    ear.box.extend(corners_[at.before].P).extend(corners_[at.after].P);
    const std::int32_t found = first_in(ear, at.look_from, 1, 0, first_leaf_ * leaf);
    if (found == none) return true;
    at.look_from = found + 1;
    wait(corner, order_[found]);
    return false;
}

void PolygonCutter::wait(std::int32_t corner, std::int32_t for_which)
{
    Corner& at = corners_[corner];
    std::int32_t& first = corners_[for_which].first_waiting;
    at.waits_for = for_which;
    at.previous = none;
    at.next = first;
    if (first != none) corners_[first].previous = corner;
    first = corner;
}

void PolygonCutter::stop_waiting(std::int32_t corner)
{
    Corner& at = corners_[corner];
    if (at.waits_for == none) return;
    (at.previous != none ? corners_[at.previous].next : corners_[at.waits_for].first_waiting) = at.next;
    if (at.next != none) corners_[at.next].previous = at.previous;
    at.waits_for = none;
}

void PolygonCutter::make_ready(std::int32_t corner)
{
    stop_waiting(corner);
    if (corners_[corner].ready) return;
    corners_[corner].ready = true;
    ready_.push_back(corner);
    std::push_heap(ready_.begin(), ready_.end(), std::greater());
}

std::int32_t PolygonCutter::take_ready()
{
    std::pop_heap(ready_.begin(), ready_.end(), std::greater());
    const std::int32_t corner = ready_.back();
    ready_.pop_back();
    corners_[corner].ready = false;
    return corner;
}

void PolygonCutter::cut_off(std::int32_t corner)
{
    Corner& at = corners_[corner];
    at.left = false;
    for (std::int32_t k = first_leaf_ + at.index / leaf; k > 0; k /= 2) --boxes_[k].left;
    corners_[at.before].after = at.after;
    corners_[at.after].before = at.before;
    while (at.first_waiting != none) make_ready(at.first_waiting);
    for (const std::int32_t neighbour : {at.before, at.after}) {
        corners_[neighbour].look_from = 0;
        if (neighbour != 0) make_ready(neighbour);  // the first corner is never cut off
    }
}

bool PolygonCutter::append(std::span<const Vec3f> positions, std::span<const std::int32_t> corners,
                           std::vector<Mesh::Triangle>& triangles)
{
    std::size_t left = corners.size();
    if (left > max_corners) return false;
    if (left == 3 || is_convex_quad(positions, corners) || !flatten(positions, corners)) {
        for (std::size_t i = 1; i + 1 < left; ++i) triangles.emplace_back(corners[0], corners[i], corners[i + 1]);
        return true;
    }
    fill_boxes();
    looks_ = 0;
    corners_[0].ready = false;
    ready_.clear();
    for (std::int32_t i = 1; i < static_cast<std::int32_t>(left); ++i) ready_.push_back(i);
    while (left > 3 && !ready_.empty()) {
        const std::int32_t i = take_ready();
        if (is_ear(i)) {
            triangles.emplace_back(corners[corners_[i].before], corners[i], corners[corners_[i].after]);
            cut_off(i);
            --left;
        }
        if (looks_ > max_looks * corners.size()) return false;
    }
    // The rest is a triangle, crosses itself, or has no area.
    for (std::int32_t i = corners_[0].after; corners_[i].after != 0; i = corners_[i].after)
        triangles.emplace_back(corners[0], corners[i], corners[corners_[i].after]);
    return true;
}

}  // namespace rapid
