#include "runtime/shapes/level_set/grid_file.h"

#include <fmt/format.h>

#include "runtime/base/error.h"
#include "runtime/files/output_file.h"

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

bool is_uniform(const openvdb::Mat4R& map)
{
    return map(0, 0) > 0 && map(0, 0) == map(1, 1) && map(1, 1) == map(2, 2) && map(0, 1) == 0 && map(0, 2) == 0 &&
           map(1, 0) == 0 && map(1, 2) == 0 && map(2, 0) == 0 && map(2, 1) == 0;
}

bool is_uniform(const openvdb::math::Transform& transform)
{
    return transform.isLinear() && is_uniform(transform.baseMap()->getAffineMap()->getMat4());
}

openvdb::math::Transform::Ptr transform_of(const openvdb::Mat4R& map, const std::string& name)
{
    const double volume = map.getMat3().det();
    if (!map.isFinite() || !std::isnormal(volume))
        throw Error(fmt::format("the transform of grid \"{}\" has no inverse: its voxels have {} m³", name, volume));
    if (!is_uniform(map)) return openvdb::math::Transform::createLinearTransform(map);
    auto transform = openvdb::math::Transform::createLinearTransform(map(0, 0));
    const openvdb::Vec3d translation = map.getTranslation();
    if (translation != openvdb::Vec3d(0)) transform->postTranslate(translation);
    return transform;
}

void check_extent(const openvdb::CoordBBox& leaves, const std::string& name)
{
    if (leaves.empty()) return;
    constexpr double most = 1 << 28;  // a gigabyte of index: 5,000 voxels along each axis
    double blocks = 1;
    for (int axis = 0; axis < 3; ++axis)
        blocks *= (static_cast<double>(leaves.max()[axis]) - static_cast<double>(leaves.min()[axis])) / 8 + 1;
    if (blocks > most)
        throw Error(fmt::format(
            "the values of grid \"{}\" are spread over {:.3g} boxes of 8 x 8 x 8 voxels; at most {:.3g} are possible",
            name, blocks, most));
}

namespace {

// Writes the format of openvdb::io::File to a stream.
class Archive : public openvdb::io::Archive {
public:
    void write_to(std::ostream& stream, const openvdb::GridCPtrVec& grids) const
    {
        openvdb::io::Archive::write(stream, grids, /*seekable=*/true);
    }
};

}  // namespace

void write_archive(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids)
{
    for (const auto& grid : grids)
        if (grid->getName().empty())
            throw Error(fmt::format("cannot write \"{}\": the grid needs a name", path.string()));
    try {
        OutputFile file(path);
        OutputStream stream(file);
        Archive().write_to(stream, grids);
        stream.flush();
        file.finish();
    } catch (const std::exception& e) {
        throw Error(fmt::format("cannot write \"{}\": {}", path.string(), e.what()));
    }
}

}  // namespace rapid
