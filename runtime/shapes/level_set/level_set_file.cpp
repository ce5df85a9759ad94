// Reads level sets from .vdb files by grid name.
#include <fmt/format.h>
#include <openvdb/tools/ChangeBackground.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/shapes/level_set/grid_file.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/vdb_file.h"

namespace rapid {
namespace {

using openvdb::FloatGrid;

bool is_level_set(const openvdb::GridBase& grid)
{
    return grid.isType<FloatGrid>() && grid.getGridClass() == openvdb::GRID_LEVEL_SET;
}

openvdb::GridBase::Ptr choose_level_set(const std::string& path, const std::string& name,
                                        const openvdb::GridPtrVec& grids)
{
    if (!name.empty()) return grid_of_name(path, name, grids);
    openvdb::GridPtrVec level_sets;
    for (const auto& grid : grids)
        if (is_level_set(*grid)) level_sets.push_back(grid);
    if (level_sets.size() == 1) return level_sets[0];
    if (level_sets.empty())
        throw Error(fmt::format("there is no level set in \"{}\"; its grids are {}", path, grids_of(grids)));
    throw Error(fmt::format("there are {} level sets in \"{}\": {}; choose one with grid", level_sets.size(), path,
                            grids_of(level_sets)));
}

// Reads the metadata of all grids and only the values of the chosen one. All allocations whose size the file dictates
// happen here, in the process that is allowed to fail.
FloatGrid::Ptr read_level_set_grid(const std::filesystem::path& file_path, const std::string& name)
{
    initialize_openvdb();
    const std::string path = file_path.string();
    try {
        VdbFile file(file_path);
        const auto chosen = choose_level_set(path, name, file.grids());
        if (!is_level_set(*chosen))
            throw Error(fmt::format("grid \"{}\" of \"{}\" is {} with the class \"{}\"; it must be a float level set",
                                    chosen->getName(), path, chosen->valueType(),
                                    openvdb::GridBase::gridClassToString(chosen->getGridClass())));
        const auto grid = openvdb::gridPtrCast<FloatGrid>(file.read(chosen));
        if (grid->tree().hasActiveTiles()) grid->tree().voxelizeActiveTiles(/*threaded=*/false);
        return grid;
    } catch (const openvdb::Exception& e) {
        throw Error(fmt::format("cannot read \"{}\": {}; it must be an OpenVDB file", path, e.what()));
    }
}

const SandboxedReader<FloatGrid::Ptr> level_set_reader("level set", read_level_set_grid, send_grid<FloatGrid>,
                                                       receive_grid<FloatGrid>);

// Returns the median length of the gradient at voxels next to the surface: 1 if the values are distances.
double gradient_near_surface(const FloatGrid& grid)
{
    const double voxel = grid.voxelSize()[0];
    openvdb::tree::ValueAccessor<const FloatGrid::TreeType, /*IsSafe=*/false> accessor(grid.tree());
    constexpr std::size_t enough = 4096;
    std::vector<double> lengths;
    for (auto value = grid.cbeginValueOn(); value; ++value) {
        const openvdb::Coord at = value.getCoord();
        double squares = 0;
        bool changes_sign = false;
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord before = at, after = at;
            --before[axis], ++after[axis];
            const float a = accessor.getValue(before), b = accessor.getValue(after);
            squares += std::pow((double(b) - a) / (2 * voxel), 2);
            changes_sign |= (a < 0) != (b < 0);
        }
        if (changes_sign) lengths.push_back(std::sqrt(squares));
        if (lengths.size() == enough) break;
    }
    if (lengths.empty()) return 1;
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    return *middle;
}

// Converts distances in voxels to metres. Notes values that are not distances.
void check_distances(FloatGrid& grid)
{
    const double voxel = grid.voxelSize()[0], gradient = gradient_near_surface(grid);
    constexpr double tolerance = 0.1, most = 2;  // features of a voxel's size lower the gradient
    const bool fits_voxels = std::abs(std::log(gradient * voxel)) < std::abs(std::log(gradient));
    if (fits_voxels && std::abs(gradient * voxel - 1) < tolerance) {
        SkippedContents::note(fmt::format("the distances of grid \"{}\" are in voxels; they are multiplied by {:g} m",
                                          grid.getName(), voxel));
        const auto metres = [voxel](float distance) { return static_cast<float>(distance * voxel); };
        for (auto value = grid.beginValueAll(); value; ++value) value.setValue(metres(*value));
        openvdb::tools::changeBackground(grid.tree(), metres(grid.background()));
        return;
    }
    if (gradient > 1 / most && gradient < most) return;
    SkippedContents::note(
        fmt::format("the values of grid \"{}\" change by {:.3g} per metre at its surface; distances change by 1, "
                    "so that points will stop at a wrong distance: rebuild the level set",
                    grid.getName(), gradient));
}

LevelSetPtr level_set_of_file(const std::filesystem::path& path, const std::string& name)
{
    if (std::error_code none; !std::filesystem::exists(path, none))
        throw Error(fmt::format("there is no file \"{}\"", path.string()));
    initialize_openvdb();
    FloatGrid::Ptr grid = read_grid_sandboxed<FloatGrid>(level_set_reader, path, name);
    if (grid->activeVoxelCount() == 0)
        throw Error(
            fmt::format("grid \"{}\" of \"{}\" is empty; a level set needs a surface", grid->getName(), path.string()));

    if (is_uniform(grid->transform()))
        check_distances(*grid);
    else
        grid = on_cubic_voxels(*grid);
    const auto level_set = level_set_of(grid, [grid](double half_width) { return widened(*grid, half_width); });
    if (!level_set->has_surface())
        throw Error(
            fmt::format("grid \"{}\" of \"{}\" has {} active voxels but no surface; a level set must change its sign",
                        grid->getName(), path.string(), grid->activeVoxelCount()));
    return level_set;
}

void write_to(const LevelSetGrid& grid, const std::filesystem::path& path, const std::string& name)
{
    write_archive(path, {named_grid(*grid.grid, name)});
}

RAPID_DEFINE(read_level_set, level_set_of_file);
RAPID_DEFINE(write_level_set_grid, write_to);

}  // namespace
}  // namespace rapid
