#include "runtime/shapes/mesh/ray_crossings.h"

#include <algorithm>
#include <cmath>

namespace rapid {
namespace {

// Returns true if a line along x at (y, z) meets the triangle, that is, if in that plane a ray along +y crosses an odd
// number of its sides. The crossing of a side is computed from its lower end to its upper one, so that both adjacent
// faces get bit-identical results.
bool meets(const Vec3d (&corners)[3], double y, double z)
{
    bool within = false;
    for (int k = 0; k < 3; ++k) {
        const Vec3d &a = corners[k], &b = corners[(k + 1) % 3];
        if ((a.z() > z) == (b.z() > z)) continue;
        const Vec3d &low = a.z() < b.z() ? a : b, &high = a.z() < b.z() ? b : a;
        within ^= y < low.y() + (z - low.z()) * (high.y() - low.y()) / (high.z() - low.z());
    }
    return within;
}

}  // namespace

RayCrossings::RayCrossings(MeshPtr mesh) : mesh_(std::move(mesh)), bounds_(mesh_->bounds().cast<double>())
{
    // About one triangle per bin if they are evenly distributed.
    bins_ = std::clamp(static_cast<int>(std::sqrt(double(mesh_->triangles.size()))), 1, 2048);
    per_metre_ = Vec3d::Constant(bins_).cwiseQuotient(bounds_.sizes().cwiseMax(1e-30));

    // Two passes over the triangles: count, then fill.
    first_.assign(std::size_t(bins_) * bins_ + 1, 0);
    for_each_bin([&](std::size_t bin, std::int32_t) { ++first_[bin + 1]; });
    for (std::size_t bin = 1; bin < first_.size(); ++bin) first_[bin] += first_[bin - 1];
    triangles_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for_each_bin([&](std::size_t bin, std::int32_t triangle) { triangles_[next[bin]++] = triangle; });
}

int RayCrossings::bin_at(double coordinate, int axis) const
{
    return static_cast<int>(std::clamp((coordinate - bounds_.min()[axis]) * per_metre_[axis], 0.0, bins_ - 1.0));
}

template <class F>
void RayCrossings::for_each_bin(const F& f) const
{
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh_->triangles.size()); ++t) {
        const Vec3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
        const Vec3d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
        for (int y = bin_at(low.y(), 1); y <= bin_at(high.y(), 1); ++y)
            for (int z = bin_at(low.z(), 2); z <= bin_at(high.z(), 2); ++z) f(std::size_t(y) * bins_ + z, t);
    }
}

RayCrossings::Count RayCrossings::from(const Vec3d& P) const
{
    Count count;
    if (!bounds_.contains(P)) return count;
    const std::size_t bin = std::size_t(bin_at(P.y(), 1)) * bins_ + bin_at(P.z(), 2);
    for (std::size_t i = first_[bin]; i < first_[bin + 1]; ++i) {
        const Vec3d corners[3] = {corner(triangles_[i], 0), corner(triangles_[i], 1), corner(triangles_[i], 2)};
        const auto& [a, b, c] = corners;
        if (P.x() >= std::max({a.x(), b.x(), c.x()}) || !meets(corners, P.y(), P.z())) continue;
        // If the triangle's box does not decide whether it is ahead, the side of its plane does.
        const Vec3d normal = (b - a).cross(c - a);
        const bool ahead = P.x() < std::min({a.x(), b.x(), c.x()}) || (normal.dot(P - a) < 0) == (normal.x() > 0);
        if (!ahead) continue;
        ++count.faces;
        count.windings += normal.x() > 0 ? 1 : -1;
    }
    return count;
}

void RayCrossings::along_x(double y, double z, std::vector<Crossing>& crossings) const
{
    crossings.clear();
    if (y < bounds_.min().y() || y > bounds_.max().y() || z < bounds_.min().z() || z > bounds_.max().z()) return;
    const std::size_t bin = std::size_t(bin_at(y, 1)) * bins_ + bin_at(z, 2);
    for (std::size_t i = first_[bin]; i < first_[bin + 1]; ++i) {
        const Vec3d corners[3] = {corner(triangles_[i], 0), corner(triangles_[i], 1), corner(triangles_[i], 2)};
        if (!meets(corners, y, z)) continue;
        const auto& [a, b, c] = corners;
        const Vec3d normal = (b - a).cross(c - a);
        const double x = a.x() - (normal.y() * (y - a.y()) + normal.z() * (z - a.z())) / normal.x();
        // For a triangle seen edge-on, rounding decides x. The clamp keeps it between the corners.
        const double lowest = std::min({a.x(), b.x(), c.x()}), highest = std::max({a.x(), b.x(), c.x()});
        crossings.push_back({x >= lowest ? std::min(x, highest) : lowest, normal.x() > 0 ? 1 : -1, triangles_[i]});
    }
    std::sort(crossings.begin(), crossings.end(),
              [](const Crossing& one, const Crossing& two) { return one.x < two.x; });
}

}  // namespace rapid
