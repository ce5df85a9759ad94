#include "runtime/shapes/level_set/write_grids.h"

#include <fmt/format.h>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/grid_file.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/open_grids.h"

namespace rapid {
namespace {

openvdb::GridBase::ConstPtr named(const std::string& name, const ObjectPtr& object)
{
    if (const auto fog = std::dynamic_pointer_cast<const OpenDensityGrid>(object))
        return named_grid(*fog->grid(), name);
    if (const auto vectors = std::dynamic_pointer_cast<const OpenVectorGrid>(object))
        return named_grid(*vectors->grid(), name);
    throw Error(fmt::format("{} = {}; it must be a fog or a grid of vectors at one frame", name,
                            object ? object->kind() : "nothing"));
}

void write(const std::filesystem::path& path, const std::map<std::string, ObjectPtr>& grids)
{
    if (grids.empty()) throw Error(fmt::format("cannot write \"{}\": there is no grid", path.string()));
    initialize_openvdb();
    openvdb::GridCPtrVec written;
    for (const auto& [name, object] : grids) written.push_back(named(name, object));
    write_archive(path, written);
}

RAPID_DEFINE(write_grids, write);

}  // namespace
}  // namespace rapid
