#include "runtime/shapes/level_set/vector_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/grid_file.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/open_grids.h"
#include "runtime/shapes/level_set/vdb_file.h"

namespace rapid {
namespace {

using openvdb::Vec3SGrid;

openvdb::GridBase::Ptr choose_vectors(const std::string& path, const std::string& name,
                                      const openvdb::GridPtrVec& grids)
{
    if (!name.empty()) return grid_of_name(path, name, grids);
    openvdb::GridPtrVec vectors;
    for (const auto& grid : grids)
        if (grid->isType<Vec3SGrid>()) vectors.push_back(grid);
    if (vectors.size() == 1) return vectors[0];
    if (vectors.empty())
        throw Error(
            fmt::format("there is no grid of vectors (vec3s) in \"{}\"; its grids are {}", path, grids_of(grids)));
    throw Error(fmt::format("there are {} grids of vectors in \"{}\": {}; choose one with grid", vectors.size(), path,
                            grids_of(vectors)));
}

// Three grids of floats that hold the components of a vector.
struct Components {
    std::string name;
    std::array<openvdb::GridBase::Ptr, 3> grids;
};

// Returns the components NAME.x NAME.y NAME.z, or with _ for the dot, of the only vector of that form, or of the one
// with this name.
std::optional<Components> find_components(const std::string& name, const openvdb::GridPtrVec& grids)
{
    std::vector<Components> found;
    for (const char separator : {'.', '_'})
        for (const auto& grid : grids) {
            const std::string& first = grid->getName();
            const std::string stem = first.substr(0, first.size() < 2 ? 0 : first.size() - 2);
            if (stem.empty() || first != stem + separator + 'x' || (!name.empty() && stem != name)) continue;
            Components components{stem, {}};
            for (const auto& other : grids)
                for (int axis = 0; axis < 3; ++axis)
                    if (other->isType<openvdb::FloatGrid>() && other->getName() == stem + separator + "xyz"[axis])
                        components.grids[static_cast<std::size_t>(axis)] = other;
            if (components.grids[0] && components.grids[1] && components.grids[2])
                found.push_back(std::move(components));
        }
    if (found.size() != 1) return std::nullopt;
    return found[0];
}

Vec3SGrid::Ptr joined_components(VdbFile& file, const Components& components)
{
    Vec3SGrid::Ptr vectors = Vec3SGrid::create();
    vectors->setName(components.name);
    vectors->setTransform(components.grids[0]->transform().copy());
    auto to = vectors->getAccessor();
    for (int axis = 0; axis < 3; ++axis) {
        const auto& component = components.grids[static_cast<std::size_t>(axis)];
        if (component->transform() != vectors->transform())
            throw Error(
                fmt::format("the grids \"{}\" and \"{}\" have different maps; the components of a vector must "
                            "have the same",
                            components.grids[0]->getName(), component->getName()));
        const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.read(component));
        grid->tree().voxelizeActiveTiles(/*threaded=*/false);
        for (auto value = grid->cbeginValueOn(); value; ++value) {
            openvdb::Vec3s vector = to.getValue(value.getCoord());
            vector[axis] = *value;
            to.setValue(value.getCoord(), vector);
        }
    }
    return vectors;
}

Vec3SGrid::Ptr read_vectors(const std::filesystem::path& file_path, const std::string& name)
{
    initialize_openvdb();
    const std::string path = file_path.string();
    try {
        VdbFile file(file_path);
        const bool has_vectors = std::any_of(file.grids().begin(), file.grids().end(), [&](const auto& grid) {
            return name.empty() ? grid->template isType<Vec3SGrid>() : grid->getName() == name;
        });
        if (!has_vectors)
            if (const auto components = find_components(name, file.grids()))
                return joined_components(file, *components);
        const auto chosen = choose_vectors(path, name, file.grids());
        if (!chosen->isType<Vec3SGrid>())
            throw Error(
                fmt::format("grid \"{}\" of \"{}\" is {}; it must have vectors (vec3s), or be three grids of "
                            "floats, NAME.x NAME.y NAME.z",
                            chosen->getName(), path, chosen->valueType()));
        return openvdb::gridPtrCast<Vec3SGrid>(file.read(chosen));
    } catch (const openvdb::Exception& e) {
        throw Error(fmt::format("cannot read \"{}\": {}; it must be an OpenVDB file", path, e.what()));
    }
}

const SandboxedReader<Vec3SGrid::Ptr> vectors_reader("vector grid", read_vectors, send_grid<Vec3SGrid>,
                                                     receive_grid<Vec3SGrid>);

VectorGridPtr vectors_of_file(const std::filesystem::path& path, const std::string& name)
{
    if (std::error_code none; !std::filesystem::exists(path, none))
        throw Error(fmt::format("there is no file \"{}\"", path.string()));
    initialize_openvdb();
    return std::make_shared<OpenVectorGrid>(read_grid_sandboxed<Vec3SGrid>(vectors_reader, path, name));
}

VectorGridPtr make(const Vec3d& origin, double voxel, const Eigen::Vector3i& nodes, std::span<const Vec3f> values)
{
    initialize_openvdb();
    auto grid = Vec3SGrid::create();
    auto accessor = grid->getAccessor();
    std::size_t at = 0;
    for (int x = 0; x < nodes.x(); ++x)
        for (int y = 0; y < nodes.y(); ++y)
            for (int z = 0; z < nodes.z(); ++z, ++at)
                accessor.setValue({x, y, z}, {values[at].x(), values[at].y(), values[at].z()});
    auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    transform->postTranslate({origin.x(), origin.y(), origin.z()});
    grid->setTransform(transform);
    return std::make_shared<OpenVectorGrid>(grid);
}

RAPID_DEFINE(read_vector_grid, vectors_of_file);
RAPID_DEFINE(make_vector_grid, make);

}  // namespace
}  // namespace rapid
