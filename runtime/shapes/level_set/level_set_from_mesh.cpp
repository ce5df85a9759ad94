// Builds level sets from meshes and warns about meshes that make unreliable ones.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <optional>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/baked_level_set.h"
#include "runtime/shapes/level_set/buildable.h"
#include "runtime/shapes/level_set/mesh_blocks.h"
#include "runtime/shapes/mesh/open_mesh.h"

namespace rapid {
namespace {

// There are two routes. A narrow band of a closed mesh whose pieces do not overlap is measured by blocks and baked from
// them: three voxels took 71 ms where OpenVDB's distances with corrections took 145, and resolving OpenVDB's symbols
// would take another 35. Everything else needs an OpenVDB grid: searches and signs that propagate between voxels, and
// bands so wide that testing each triangle takes longer (twice as long at 50 voxels).
std::shared_ptr<const BakedLevelSet> build(const MeshPtr& mesh, bool balanced, const LevelSetOptions& options)
{
    const Box3d bounds = mesh->bounds().cast<double>();
    constexpr double far = 2147483648.0;  // voxels; up to here integers are exact and OpenVDB's maps invertible
    if (const double farthest = bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).maxCoeff();
        !(farthest <= far * options.voxel))
        throw Error(
            fmt::format("mesh \"{}\" reaches {:g} m from the origin, more than 2^31 voxels of {:g} m; move it nearer "
                        "to the origin, and move the level set back",
                        mesh->name, farthest, options.voxel));
    require_buildable(fmt::format("mesh \"{}\"", mesh->name), mesh->area(), bounds, options);
    const VoxelFrame frame = frame_around(bounds, options.voxel);
    const double half_width = options.half_width * options.voxel;
    const auto rebuild = [mesh, balanced, voxel = options.voxel](double wide) {
        return build(mesh, balanced, {voxel, wide / voxel});
    };
    std::optional<MeshBlocks> measured;
    if (balanced && half_width <= MeshBlocks::widest * frame.voxel) measured = measure(*mesh, frame, half_width);
    if (measured && !measured->overlap) {
        const auto grid = [=] { return grid_of_blocks(measure(*mesh, frame, half_width).blocks); };
        return std::make_shared<BakedLevelSet>(bake(measured->blocks), measured->blocks.voxels_in_band(),
                                               BakedLevelSet::Source{grid, rebuild});
    }
    return level_set_of_grid(grid_of_mesh(*mesh, balanced, frame, half_width, measured ? &*measured : nullptr),
                             rebuild);
}

// Returns the bounds of the connected parts of a mesh.
std::vector<Box3f> pieces_of(const Mesh& mesh)
{
    std::vector<std::int32_t> parent(mesh.positions.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](std::int32_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    for (const Mesh::Triangle& t : mesh.triangles) {
        parent[root(t[1])] = root(t[0]);
        parent[root(t[2])] = root(t[0]);
    }
    std::vector<Box3f> bounds(mesh.positions.size());
    for (const Mesh::Triangle& t : mesh.triangles)
        for (const std::int32_t i : t) bounds[root(i)].extend(mesh.positions[i]);
    std::erase_if(bounds, [](const Box3f& box) { return box.isEmpty(); });
    return bounds;
}

// Warns about a mesh that is questionable but usable.
void warn(const Mesh& mesh, const Mesh::Openness& open, const LevelSetOptions& options,
          std::vector<std::string>& warnings)
{
    if (open.unbalanced_edges > 0)
        warnings.push_back(fmt::format(
            "mesh \"{}\" is not closed: {} edges have one face, and {} have more than two or two that face different "
            "ways; holes smaller than a voxel ({:g} m) are closed; with larger ones the inside counts as outside",
            mesh.name, open.boundary_edges, open.non_manifold_edges, options.voxel));
    else if (const double volume = mesh.signed_volume(); volume < 0)
        warnings.push_back(
            fmt::format("mesh \"{}\" is inside out: its volume is {:.4g} m³; its faces are assumed to point outwards",
                        mesh.name, volume));
    const std::vector<Box3f> pieces = pieces_of(mesh);
    const auto thin = std::count_if(pieces.begin(), pieces.end(),
                                    [&](const Box3f& bounds) { return bounds.sizes().minCoeff() < options.voxel; });
    if (thin > 0)
        warnings.push_back(
            fmt::format("{} of the {} pieces of mesh \"{}\" are thinner than a voxel ({:g} m) and may be missing; use "
                        "a smaller voxel",
                        thin, pieces.size(), mesh.name, options.voxel));
    Box3f bounds;
    for (const Box3f& piece : pieces) bounds.extend(piece);
    if (const double size = bounds.isEmpty() ? 0 : bounds.sizes().maxCoeff();
        2 * options.voxel >= size * (1 - 1e-6) && size > 0)  // sizes are floats
        warnings.push_back(fmt::format(
            "a voxel of {:g} m is at least half as large as mesh \"{}\", which is {:g} m long; use a voxel of {:.1g} m",
            options.voxel, mesh.name, size, size / 30));
}

}  // namespace

LevelSetPtr level_set_of_same_faces(const MeshPtr& mesh, const LevelSetOptions& options, const Mesh::Openness& open)
{
    const bool balanced = open.unbalanced_edges == 0;
    const auto level_set = build(mesh, balanced, options);
    if (!level_set->has_surface()) {
        if (!balanced)
            throw Error(
                fmt::format("mesh \"{}\" has no inside with voxel = {:g} m, because {} of its edges have one face; {}",
                            mesh->name, options.voxel, open.boundary_edges, open_mesh_remedy));
        const Vec3f size = mesh->bounds().sizes();
        if (size.minCoeff() == 0)
            throw Error(
                fmt::format("mesh \"{}\" is flat: its size is {:g} x {:g} x {:g} m; a level set needs an inside",
                            mesh->name, size.x(), size.y(), size.z()));
        throw Error(
            fmt::format("mesh \"{}\" vanishes with voxel = {:g} m: its size is {:g} x {:g} x {:g} m; use a voxel "
                        "of at most {:.3g} m",
                        mesh->name, options.voxel, size.x(), size.y(), size.z(), size.minCoeff() / 3));
    }
    return level_set;
}

LevelSetPtr level_set_from_mesh(const MeshPtr& mesh, const LevelSetOptions& options, std::vector<std::string>& warnings)
{
    require_legal(options);
    if (mesh->triangles.empty())
        throw Error(fmt::format("mesh \"{}\" has no faces; a level set needs a closed surface", mesh->name));
    const Mesh::Openness open = mesh->openness();
    LevelSetPtr level_set = level_set_of_same_faces(mesh, options, open);
    warn(*mesh, open, options, warnings);
    return level_set;
}

}  // namespace rapid
