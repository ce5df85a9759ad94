// Reads level sets from .vdb files by grid name.
#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/grid_file.h"
#include "runtime/shapes/level_set/grid_message.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/vdb_archive.h"
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
        // Exact, because a rotation, a shear or unequal scales would require resampling.
        if (!is_uniform(chosen->transform()))
            throw Error(
                fmt::format("the transform of grid \"{}\" of \"{}\" is not a uniform scale and a translation; resample "
                            "the grid to cubic voxels along the axes",
                            chosen->getName(), path));
        const auto grid = openvdb::gridPtrCast<FloatGrid>(file.read(chosen));
        if (grid->tree().hasActiveTiles()) grid->tree().voxelizeActiveTiles(/*threaded=*/false);
        return grid;
    } catch (const openvdb::Exception& e) {
        throw Error(fmt::format("cannot read \"{}\": {}; it must be an OpenVDB file", path, e.what()));
    }
}

const SandboxedReader<FloatGrid::Ptr> level_set_reader("level set", read_level_set_grid, send_grid<FloatGrid>,
                                                       receive_grid<FloatGrid>);

LevelSetPtr level_set_of_file(const std::filesystem::path& path, const std::string& name)
{
    if (std::error_code none; !std::filesystem::exists(path, none))
        throw Error(fmt::format("there is no file \"{}\"", path.string()));
    initialize_openvdb();
    const FloatGrid::Ptr grid = read_grid_sandboxed<FloatGrid>(level_set_reader, path, name);
    if (grid->activeVoxelCount() == 0)
        throw Error(
            fmt::format("grid \"{}\" of \"{}\" is empty; a level set needs a surface", grid->getName(), path.string()));

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
