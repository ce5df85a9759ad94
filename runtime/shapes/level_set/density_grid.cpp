#include "runtime/shapes/level_set/density_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "runtime/base/error.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/shapes/level_set/grid_file.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/open_grids.h"
#include "runtime/shapes/level_set/vdb_file.h"
#include "runtime/shapes/scatter/alias_table.h"

namespace rapid {
namespace {

using openvdb::FloatGrid;

// Active voxels with one value: a single voxel, or a tile of the tree.
struct Cell {
    openvdb::Coord origin;
    int edge;  // voxels
};

// A trilinear density is the sum over the voxels of d_i times a hat function with the same integral everywhere. A birth
// draws a voxel by its value, then an offset from the hat along each axis. The sum of two uniform numbers has that
// density.
class ScatterInFog final : public Scatter {
public:
    ScatterInFog(openvdb::math::Transform::ConstPtr transform, std::vector<Cell> cells, AliasTable chances)
        : transform_(std::move(transform)), cells_(std::move(cells)), chances_(std::move(chances))
    {
    }

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        for (std::size_t i = 0; i < out.size(); ++i) {
            const auto a = uniform4(key, first + i, 0), b = uniform4(key, first + i, 1);
            const auto c = uniform4(key, first + i, 2);
            const Cell& cell = cells_[static_cast<std::size_t>(chances_.draw(a[0], a[1]))];
            const double up[] = {a[2], a[3], b[0]}, down[] = {b[1], b[2], b[3]};
            openvdb::Vec3d at;
            for (int axis = 0; axis < 3; ++axis) {
                const double voxel = std::floor(c[static_cast<std::size_t>(axis)] * cell.edge);
                at[axis] = cell.origin[axis] + voxel + up[axis] - down[axis];
            }
            const openvdb::Vec3d P = transform_->indexToWorld(at);
            out[i] = Birthplace{};
            out[i].P = Vec3d(P.x(), P.y(), P.z()).cast<float>();
        }
    }

private:
    openvdb::math::Transform::ConstPtr transform_;
    std::vector<Cell> cells_;
    AliasTable chances_;
};

}  // namespace

ScatterPtr scatter_in_fog(const FloatGrid& grid)
{
    std::vector<Cell> cells;
    std::vector<double> weights;
    for (auto value = grid.tree().cbeginValueOn(); value; ++value) {
        if (*value == 0) continue;
        openvdb::CoordBBox box;
        value.getBoundingBox(box);
        const openvdb::Coord at = box.min();
        if (!(*value > 0))
            throw Error(fmt::format("grid \"{}\" is {} at voxel {} {} {}; a density must be at least 0", grid.getName(),
                                    *value, at.x(), at.y(), at.z()));
        const int edge = box.dim().x();
        cells.push_back({at, edge});
        weights.push_back(double(*value) * std::pow(double(edge), 3));
    }
    if (cells.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
        throw Error(fmt::format("grid \"{}\" has {} voxels with a density; at most 2^31 - 1 are possible",
                                grid.getName(), cells.size()));
    if (cells.empty())
        throw Error(fmt::format("grid \"{}\" has no density above 0, so it can't emit points", grid.getName()));
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    return std::make_shared<ScatterInFog>(grid.constTransformPtr(), std::move(cells), AliasTable(weights, sum));
}

double OpenDensityGrid::total() const
{
    double sum = 0;
    for (auto value = grid_->tree().cbeginValueOn(); value; ++value)
        sum += double(*value) * static_cast<double>(value.getVoxelCount());
    const openvdb::Vec3d size = grid_->voxelSize();
    return sum * size.x() * size.y() * size.z();
}

namespace {

bool is_fog(const openvdb::GridBase& grid)
{
    return grid.isType<FloatGrid>() && grid.getGridClass() != openvdb::GRID_LEVEL_SET;
}

openvdb::GridBase::Ptr choose_fog(const std::string& path, const std::string& name, const openvdb::GridPtrVec& grids)
{
    if (!name.empty()) return grid_of_name(path, name, grids);
    openvdb::GridPtrVec fogs;
    for (const auto& grid : grids)
        if (is_fog(*grid)) fogs.push_back(grid);
    if (fogs.size() == 1) return fogs[0];
    if (fogs.empty())
        throw Error(fmt::format("there is no fog of floats in \"{}\"; its grids are {}", path, grids_of(grids)));
    throw Error(
        fmt::format("there are {} fogs in \"{}\": {}; choose one with grid", fogs.size(), path, grids_of(fogs)));
}

FloatGrid::Ptr read_fog(const std::filesystem::path& file_path, const std::string& name)
{
    initialize_openvdb();
    const std::string path = file_path.string();
    try {
        VdbFile file(file_path);
        const auto chosen = choose_fog(path, name, file.grids());
        if (!is_fog(*chosen))
            throw Error(fmt::format(
                "grid \"{}\" of \"{}\" is {}{}; it must be a fog of floats; rapid.levelset.read reads level sets, and "
                "rapid.grid.read vectors",
                chosen->getName(), path, chosen->getGridClass() == openvdb::GRID_LEVEL_SET ? "a level set of " : "",
                chosen->valueType()));
        return openvdb::gridPtrCast<FloatGrid>(file.read(chosen));
    } catch (const openvdb::Exception& e) {
        throw Error(fmt::format("cannot read \"{}\": {}; it must be an OpenVDB file", path, e.what()));
    }
}

const SandboxedReader<FloatGrid::Ptr> fog_reader("fog", read_fog, send_grid<FloatGrid>, receive_grid<FloatGrid>);

// Sets small negative densities to 0: an advection overshoots, so smoke often has them.
void drop_overshoots(FloatGrid& grid)
{
    constexpr float max_overshoot = 1e-3f;  // of the largest density
    float largest = 0;
    for (auto value = grid.tree().cbeginValueOn(); value; ++value) largest = std::max(largest, *value);
    std::size_t dropped = 0;
    float lowest = 0;
    for (auto value = grid.tree().beginValueOn(); value; ++value) {
        if (!(*value < 0) || *value < -max_overshoot * largest) continue;
        lowest = std::min(lowest, *value);
        value.setValue(0);
        ++dropped;
    }
    if (dropped > 0)
        SkippedContents::note(fmt::format("{} densities of grid \"{}\" are below 0, the lowest {}; they are taken as 0",
                                          dropped, grid.getName(), lowest));
}

DensityGridPtr fog_of_file(const std::filesystem::path& path, const std::string& name)
{
    if (std::error_code none; !std::filesystem::exists(path, none))
        throw Error(fmt::format("there is no file \"{}\"", path.string()));
    initialize_openvdb();
    const FloatGrid::Ptr grid = read_grid_sandboxed<FloatGrid>(fog_reader, path, name);
    drop_overshoots(*grid);
    try {
        return std::make_shared<OpenDensityGrid>(grid);
    } catch (const Error& error) {
        throw Error(fmt::format("cannot use \"{}\": {}", path.string(), error.message()), error.kind());
    }
}

RAPID_DEFINE(read_density_grid, fog_of_file);

}  // namespace
}  // namespace rapid
