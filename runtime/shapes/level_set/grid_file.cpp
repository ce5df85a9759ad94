#include "runtime/shapes/level_set/grid_file.h"

#include <fmt/format.h>

#include "runtime/base/error.h"

namespace rapid {

std::string grids_of(const openvdb::GridPtrVec& grids)
{
    std::string list;
    for (const auto& grid : grids)
        list += fmt::format("{}\"{}\" ({}{})", list.empty() ? "" : ", ", grid->getName(),
                            grid->getGridClass() == openvdb::GRID_LEVEL_SET ? "level set of " : "", grid->valueType());
    return list.empty() ? "none" : list;
}

openvdb::GridBase::Ptr grid_of_name(const std::string& path, const std::string& name, const openvdb::GridPtrVec& grids)
{
    std::vector<std::string> names;
    for (const auto& grid : grids) {
        if (grid->getName() == name) return grid;
        names.push_back(grid->getName());
    }
    throw Error(fmt::format("there is no grid \"{}\" in \"{}\"; it has {}{}", name, path, grids_of(grids),
                            did_you_mean(name, names)));
}

}  // namespace rapid
