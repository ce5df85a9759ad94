#include "runtime/io/vdb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>
#include <vector>

#include "runtime/points/column_files.h"

namespace rapid {

// Registers .vdb. Its writer and reader (vdb_write.cpp, vdb_read.cpp) are loaded on demand.

namespace {

void write_vdb(OutputFile& file, const PointSet& points, const FrameInfo& frame) { vdb_writer(file, points, frame); }

PointSet read_vdb(const std::filesystem::path& path) { return vdb_reader(path); }

RAPID_FORMAT(Format{".vdb", "OpenVDB points, read by Houdini; keeps every bit", write_vdb, read_vdb});

// Target number of points per leaf (8³ voxels). Fewer make leaves costly (each has 2 KiB of offsets and an array per
// attribute). More make spatial queries slow and leave the threads nothing to share.
constexpr double leaf_points = 2048;
constexpr double leaf_width = 8;  // voxels

// OpenVDB refuses a map whose determinant, the cube of the voxel size, is below 3e-15, so 2^-16 m is the finest.
constexpr int smallest_exponent = -16;

// Returns the largest |coordinate|. Throws Error if one is not finite.
double largest_coordinate(const PointSet& points)
{
    const Strided<Vec3f> P = points.P().read();
    double largest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double here = P[i].cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
        if (!std::isfinite(here))
            throw Error(fmt::format(
                "point {}: P = {} {} {} is too far away for a grid; write .bgeo, .ply or .csv, or remove the point",
                points.id()[i], P[i].x(), P[i].y(), P[i].z()));
        largest = std::max(largest, here);
        if (i % 65536 == 0) trim_columns();
    }
    return largest;
}

// Returns the number of cells of size 2^exponent that contain a sample point.
std::size_t occupied_cells(const std::vector<Vec3f>& sample, int exponent)
{
    std::unordered_set<std::uint64_t> cells;
    for (const Vec3f& P : sample) {
        std::uint64_t key = 0;
        // Cells whose keys collide count as one, which the estimate tolerates.
        for (int axis = 0; axis < 3; ++axis) {
            const double cell = std::floor(std::ldexp(static_cast<double>(P[axis]), -exponent));
            key = (key ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(cell))) * 0x9e3779b97f4a7c15ull;
            key ^= key >> 29;
        }
        cells.insert(key);
    }
    return cells.size();
}

}  // namespace

// Estimates the size from a sample of the points. The sample gives the width of a cell that contains several of them,
// and the dimension (line, surface, volume) with which their number grows with the width. The width of a cell with
// leaf_points points follows from these.
int voxel_exponent(const PointSet& points)
{
    const double largest = largest_coordinate(points);
    if (largest == 0) return 0;
    // The voxel index of the farthest point must fit into int32.
    const int finest = std::max(std::ilogb(largest) - 29, smallest_exponent);

    constexpr std::size_t sample_size = 4096;
    constexpr double sampled_in_cell = 8;
    const std::size_t step = (points.size() + sample_size - 1) / sample_size;
    std::vector<Vec3f> sample;
    for (std::size_t i = 0; i < points.size(); i += step) {
        sample.push_back(points.P()[i]);
        trim_columns();
    }

    // Goes from the coarsest, one cell for all, to finer ones.
    int cell = std::ilogb(largest) + 2;
    std::size_t coarser = 1, occupied = 1;
    for (; cell - 1 > finest + 3; --cell) {
        const std::size_t finer = occupied_cells(sample, cell - 1);
        if (static_cast<double>(sample.size()) / static_cast<double>(finer) < sampled_in_cell) break;
        coarser = std::exchange(occupied, finer);
    }
    const double dimension =
        std::clamp(std::log2(static_cast<double>(occupied) / static_cast<double>(coarser)), 1.0, 3.0);
    const double points_in_cell = static_cast<double>(points.size()) / static_cast<double>(occupied);
    const double finer_by = std::log2(points_in_cell / leaf_points) / dimension;
    const int exponent = cell - static_cast<int>(std::lround(finer_by)) - std::ilogb(leaf_width);
    return std::clamp(exponent, finest, std::max(finest, std::ilogb(largest) + 2));
}

}  // namespace rapid
