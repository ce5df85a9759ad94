#include "runtime/shapes/mesh/polygon.h"

namespace rapid {
namespace {

// Twice the area, along the direction from which the corners are counter-clockwise (Newell).
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

// The corners a, b, c of an ear turn left seen along the normal, and no other corner is in their triangle.
bool is_ear(std::span<const Vec3f> positions, const std::vector<std::int32_t>& left, std::size_t i, const Vec3d& normal)
{
    const auto P = [&](std::size_t k) { return positions[left[k % left.size()]].cast<double>().eval(); };
    const std::size_t before = (i + left.size() - 1) % left.size(), after = (i + 1) % left.size();
    const Vec3d a = P(before), b = P(i), c = P(after);
    const auto turn = [&](const Vec3d& p, const Vec3d& q, const Vec3d& r) { return normal.dot((q - p).cross(r - p)); };
    if (!(turn(a, b, c) > 0)) return false;
    for (std::size_t k = 0; k < left.size(); ++k) {
        if (k == before || k == i || k == after) continue;
        const Vec3d p = P(k);
        if (p == a || p == b || p == c) continue;
        if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
    }
    return true;
}

}  // namespace

void append_polygon(std::span<const Vec3f> positions, std::span<const std::int32_t> corners,
                    std::vector<Mesh::Triangle>& triangles)
{
    // Cubic in the corners; nobody draws a polygon of more.
    constexpr std::size_t most = 256;
    std::vector<std::int32_t> left(corners.begin(), corners.end());
    const Vec3d normal = normal_of(positions, corners);
    while (left.size() > 3 && corners.size() <= most) {
        std::size_t ear = 1;
        while (ear < left.size() && !is_ear(positions, left, ear, normal)) ++ear;
        if (ear == left.size()) break;  // it crosses itself, or has no area
        triangles.emplace_back(left[ear - 1], left[ear], left[(ear + 1) % left.size()]);
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    for (std::size_t i = 1; i + 1 < left.size(); ++i) triangles.emplace_back(left[0], left[i], left[i + 1]);
}

}  // namespace rapid
