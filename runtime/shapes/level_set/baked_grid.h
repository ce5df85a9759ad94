// A narrow-band level set in a form that is fast to query: every block of voxels, extended by the first layer of its
// upper neighbours, in one flat table with a coarse index. The eight corners of a cell are then always in one block,
// found by two loads.
//
// Between voxels the field is trilinear: in the band it equals OpenVDB's BoxSampler up to float rounding, and the
// gradient is the derivative of that interpolant. Beyond the band the distance is a bound of the right sign and the
// gradient zero. In an empty block the bound is the half width of the band plus the width of the blocks between it and
// the nearest block with values. Outside the index it is the distance to the box around the surface. A walk from far
// away therefore takes few steps.
//
// Layout: values, shape [blocks with values, 9, 9, 9], z fastest, metres: 2,916 bytes per block, 1.4 times the size of
// its own voxels. index, shape [blocks x, y, z], z fastest, covers the box around the band: 4 bytes per 8^3 voxels,
// empty or not.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "runtime/math/vec.h"

namespace rapid {

struct BakedGrid {
    static constexpr int block = 8;  // voxels along the edge of a block, the same as OpenVDB's leaves
    static constexpr int edge = 9;   // values along the edge; the last is the first of the upper neighbour
    static constexpr int block_values = edge * edge * edge;

    // Index codes of blocks with a single value, beyond the band: outside - 2 k or inside - 2 k. At least k blocks lie
    // between this block and the nearest one with values.
    static constexpr std::int32_t outside = -1, inside = -2;
    static bool is_outside(std::int32_t code) { return code & 1; }
    static int sign(std::int32_t code) { return 2 * (code & 1) - 1; }
    static int between(std::int32_t code) { return (-code - 1) >> 1; }

    Vec3d origin = Vec3d::Zero();  // position of the box's lowest voxel, m
    double voxel = 0;              // m
    double background = 0;         // half width of the band, m
    Eigen::Vector3i blocks = Eigen::Vector3i::Zero();
    std::vector<std::int32_t> index;
    std::vector<float> values;

    Box3d surface;                // bounds of all cells where the sign changes, m
    double slope = 0;             // largest |gradient| in any cell
    std::uint64_t crossings = 0;  // cells where the sign changes; 0 if there is no surface

    std::size_t bytes() const { return index.size() * sizeof(std::int32_t) + values.size() * sizeof(float); }
};

// Samples a BakedGrid, which must outlive it. Create one per batch of points, so that its members stay in registers.
class BakedSampler {
public:
    explicit BakedSampler(const BakedGrid& grid)
        : origin_(grid.origin),
          extent_(grid.blocks.cast<double>() * BakedGrid::block),
          last_(extent_.array() - 1),
          per_voxel_(1 / grid.voxel),
          voxel_(grid.voxel),
          block_width_(BakedGrid::block * grid.voxel),
          background_(grid.background),
          slope_(grid.slope),
          blocks_x_(grid.blocks.x()),
          blocks_y_(grid.blocks.y()),
          blocks_z_(grid.blocks.z()),
          index_(grid.index.data()),
          values_(grid.values.data()),
          surface_(grid.surface)
    {
    }

    // Returns the distance in m. Beyond the band it is a bound of the right sign.
    double distance(const Vec3d& P) const
    {
        const Cell cell = find(P);
        if (!cell.corner) return cell.bound;
        const float* c = cell.corner;
        const float c00 = c[0] + cell.z * (c[1] - c[0]);
        const float c01 = c[row] + cell.z * (c[row + 1] - c[row]);
        const float c10 = c[slab] + cell.z * (c[slab + 1] - c[slab]);
        const float c11 = c[slab + row] + cell.z * (c[slab + row + 1] - c[slab + row]);
        const float c0 = c00 + cell.y * (c01 - c00), c1 = c10 + cell.y * (c11 - c10);
        return c0 + cell.x * (c1 - c0);
    }

    // Also computes the gradient, not normalised; zero beyond the band.
    double distance(const Vec3d& P, Vec3d& gradient) const
    {
        const Cell cell = find(P);
        if (!cell.corner) {
            gradient.setZero();
            return cell.bound;
        }
        const float* c = cell.corner;
        const float d00 = c[1] - c[0], d01 = c[row + 1] - c[row];
        const float d10 = c[slab + 1] - c[slab], d11 = c[slab + row + 1] - c[slab + row];
        const float c00 = c[0] + cell.z * d00, c01 = c[row] + cell.z * d01;
        const float c10 = c[slab] + cell.z * d10, c11 = c[slab + row] + cell.z * d11;
        const float dy0 = c01 - c00, dy1 = c11 - c10;
        const float c0 = c00 + cell.y * dy0, c1 = c10 + cell.y * dy1;
        const float dz0 = d00 + cell.y * (d01 - d00), dz1 = d10 + cell.y * (d11 - d10);
        const float dx = c1 - c0;
        gradient = per_voxel_ * Vec3d(dx, dy0 + cell.x * (dy1 - dy0), dz0 + cell.x * (dz1 - dz0));
        return c0 + cell.x * dx;
    }

    // Vectorised distance(P) for up to `many` points at once, with bit-identical results.
    static constexpr int many = 64;
    void distances(int n, const double* X, const double* Y, const double* Z, double* phi) const
    {
        sample(n, X, Y, Z, phi, [](int, float, float, float) {});
    }
    // Also computes the slopes of the field along v, m/s, from the gradient, which is zero beyond the band.
    void distances_along(int n, const double* X, const double* Y, const double* Z, const double* vx, const double* vy,
                         const double* vz, double* phi, double* slope) const
    {
        sample(n, X, Y, Z, phi, [=, per_voxel = per_voxel_](int i, float dx, float dy, float dz) {
            slope[i] = per_voxel * (double(dx) * vx[i] + double(dy) * vy[i] + double(dz) * vz[i]);
        });
    }

    // Returns the inside voxel next to the surface that minimises its distance from P plus its own distance from the
    // surface; nothing if no voxel is inside. The more blocks are at a similar distance, the longer it takes.
    std::optional<Vec3d> nearest_inside(const Vec3d& P) const;

    // Returns the largest slope of the field, measured when it was baked: about 1 for a smooth surface, up to √3 where
    // the bands of two surfaces meet, anything for a field that is not a distance. At least 1, the slope of the bounds
    // beyond the band.
    double slope_bound() const { return slope_; }
    // Returns the thickness below which a wall may have no voxel inside it, m.
    double smallest_feature() const { return voxel_; }
    // Returns the half width of the band, m. Within √3 voxels of its edge a cell has corners beyond the band, and the
    // field flattens: for a radius r, request a band of r + 2 voxels.
    double band() const { return background_; }
    // Returns the error of a distance in single precision, m: seven interpolations of values up to the half width.
    double rounding() const { return 0x1p-21 * background_; }
    // Returns the bounds of the surface plus a voxel. Outside this box the distance is positive and at least the
    // distance to the box.
    Box3d bounds() const
    {
        const Vec3d margin = Vec3d::Constant(voxel_);
        return {surface_.min() - margin, surface_.max() + margin};
    }

private:
    template <class Differences>
    void sample(int n, const double* X, const double* Y, const double* Z, double* phi,
                const Differences& differences) const;

    static constexpr int row = BakedGrid::edge, slab = BakedGrid::edge * BakedGrid::edge;

    struct Cell {
        const float* corner;  // the value at the cell's lowest corner; null beyond the band
        float x, y, z;        // position in the cell, 0 to 1
        double bound;         // bound on the distance beyond the band, m
    };

    Cell find(const Vec3d& P) const
    {
        const double x = (P.x() - origin_.x()) * per_voxel_;
        const double y = (P.y() - origin_.y()) * per_voxel_;
        const double z = (P.z() - origin_.z()) * per_voxel_;
        const bool within = (x >= 0) & (y >= 0) & (z >= 0) & (x < extent_.x()) & (y < extent_.y()) & (z < extent_.z());
        if (!within) return {nullptr, 0, 0, 0, far_outside(P)};
        const int i = static_cast<int>(x), j = static_cast<int>(y), k = static_cast<int>(z);
        const std::int32_t code = index_[(std::size_t(i >> 3) * blocks_y_ + (j >> 3)) * blocks_z_ + (k >> 3)];
        if (code < 0) return {nullptr, 0, 0, 0, bound_of(code)};
        return {values_ + std::size_t(code) * BakedGrid::block_values + (i & 7) * slab + (j & 7) * row + (k & 7),
                static_cast<float>(x - i), static_cast<float>(y - j), static_cast<float>(z - k), 0};
    }

    // Bounds the distance outside the index. The surface lies in its box, so it is at least as far away as the box. One
    // voxel is subtracted for the level r > 0 of the field, which interpolation can put slightly farther out than r.
    double far_outside(const Vec3d& P) const
    {
        const Vec3d beyond = (surface_.min() - P).cwiseMax(P - surface_.max()).cwiseMax(0.0);
        return std::max(background_, beyond.norm() - voxel_);
    }

    double bound_of(std::int32_t code) const
    {
        return BakedGrid::sign(code) * (background_ + BakedGrid::between(code) * block_width_);
    }

    Vec3d origin_, extent_, last_;  // size of the box in voxels, index of its last voxel
    double per_voxel_, voxel_, block_width_, background_, slope_;
    std::int64_t blocks_x_, blocks_y_, blocks_z_;
    const std::int32_t* index_;
    const float* values_;
    Box3d surface_;
};

// Evaluates many points. differences(i, dx, dy, dz) receives the differences of the interpolant across its cell along
// the axes, m.
template <class Differences>
void BakedSampler::sample(int n, const double* X, const double* Y, const double* Z, double* phi,
                          const Differences& differences) const
{
    float x[many], y[many], z[many];       // position in the cell
    std::int64_t block[many], cell[many];  // index of the block; index within its values
    std::uint8_t within[many];
    int beyond = 0;
    for (int i = 0; i < n; ++i) {
        const double gx = (X[i] - origin_.x()) * per_voxel_, gy = (Y[i] - origin_.y()) * per_voxel_,
                     gz = (Z[i] - origin_.z()) * per_voxel_;
        within[i] = (gx >= 0) & (gy >= 0) & (gz >= 0) & (gx < extent_.x()) & (gy < extent_.y()) & (gz < extent_.z());
        beyond += !within[i];
        const auto a = static_cast<std::int32_t>(std::min(std::max(gx, 0.0), last_.x()));
        const auto b = static_cast<std::int32_t>(std::min(std::max(gy, 0.0), last_.y()));
        const auto c = static_cast<std::int32_t>(std::min(std::max(gz, 0.0), last_.z()));
        x[i] = static_cast<float>(gx - a);
        y[i] = static_cast<float>(gy - b);
        z[i] = static_cast<float>(gz - c);
        block[i] = ((a >> 3) * blocks_y_ + (b >> 3)) * blocks_z_ + (c >> 3);
        cell[i] = (a & 7) * slab + (b & 7) * row + (c & 7);
    }
    std::int32_t code[many];
    for (int i = 0; i < n; ++i) code[i] = index_[block[i]];
    for (int i = 0; i < n; ++i) cell[i] += std::int64_t(std::max(code[i], 0)) * BakedGrid::block_values;
    float corner[8][many];
    for (int i = 0; i < n; ++i) {
        const float* c = values_ + cell[i];
        const float* rows[] = {c, c + row, c + slab, c + slab + row};
        for (int k = 0; k < 4; ++k) {
            corner[2 * k][i] = rows[k][0];
            corner[2 * k + 1][i] = rows[k][1];
        }
    }
    // Local copies, which no store below can alias.
    const double background = background_, width = block_width_;
    for (int i = 0; i < n; ++i) {
        const float d00 = corner[1][i] - corner[0][i], d01 = corner[3][i] - corner[2][i];
        const float d10 = corner[5][i] - corner[4][i], d11 = corner[7][i] - corner[6][i];
        const float c00 = corner[0][i] + z[i] * d00, c01 = corner[2][i] + z[i] * d01;
        const float c10 = corner[4][i] + z[i] * d10, c11 = corner[6][i] + z[i] * d11;
        const float dy0 = c01 - c00, dy1 = c11 - c10;
        const float c0 = c00 + y[i] * dy0, c1 = c10 + y[i] * dy1;
        const float dz0 = d00 + y[i] * (d01 - d00), dz1 = d10 + y[i] * (d11 - d10), dx = c1 - c0;
        const double bound = BakedGrid::sign(code[i]) * (background + BakedGrid::between(code[i]) * width);
        phi[i] = code[i] < 0 ? bound : c0 + x[i] * dx;
        const float in_band = code[i] < 0 ? 0.0f : 1.0f;
        differences(i, in_band * dx, in_band * (dy0 + x[i] * (dy1 - dy0)), in_band * (dz0 + x[i] * (dz1 - dz0)));
    }
    if (beyond > 0)
        for (int i = 0; i < n; ++i)
            if (!within[i]) {
                phi[i] = far_outside({X[i], Y[i], Z[i]});
                differences(i, 0, 0, 0);
            }
}

}  // namespace rapid
