// The signed distance from a mesh, as an OpenVDB grid.
//
// A narrow band is measured exactly (mesh_blocks.h); this file removes faces inside from it. In a wide band every voxel
// would have too many triangles to test. It uses OpenVDB's distance, whose triangle may be the wrong one beyond two
// voxels (error up to 0.7 voxels), and corrects it to a thousandth of a voxel. The sign comes from the winding number.
// A mesh that has none gets OpenVDB's distances and signs.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <utility>

#include "runtime/base/parallel.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/mesh_blocks.h"
#include "runtime/shapes/level_set/openvdb_meshes.h"
#include "runtime/shapes/mesh/nearest_on_triangle.h"
#include "runtime/shapes/mesh/ray_crossings.h"

namespace rapid {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Int32Grid;
using Leaf = FloatTree::LeafNodeType;
using Accessor = openvdb::tree::ValueAccessor<const FloatTree, /*registered with the tree*/ false>;
using NearestAccessor = openvdb::tree::ValueAccessor<const openvdb::Int32Tree, /*registered with the tree*/ false>;

constexpr std::int32_t no_triangle = -1;

Vec3d center(const Coord& voxel) { return {double(voxel.x()), double(voxel.y()), double(voxel.z())}; }

// A mesh in voxel units.
struct InVoxels {
    MeshPtr mesh;

    Vec3d corner(std::int32_t triangle, int k) const
    {
        return mesh->positions[mesh->triangles[triangle][k]].cast<double>();
    }
    Vec3d nearest_on(std::int32_t triangle, const Coord& voxel) const
    {
        return nearest_point(center(voxel), corner(triangle, 0), corner(triangle, 1), corner(triangle, 2));
    }
    Vec3d normal(std::int32_t triangle) const
    {
        const Vec3d a = corner(triangle, 0);
        return (corner(triangle, 1) - a).cross(corner(triangle, 2) - a).stableNormalized();
    }
    double distance_to(std::int32_t triangle, const Coord& voxel) const
    {
        return (nearest_on(triangle, voxel) - center(voxel)).norm();
    }
};

FloatGrid::Ptr by_openvdb(const Mesh& mesh, const openvdb::math::Transform& transform, double half_width, int flags,
                          Int32Grid* nearest)
{
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> faces;
    for (const Vec3f& P : mesh.positions) points.emplace_back(P.x(), P.y(), P.z());
    for (const Mesh::Triangle& t : mesh.triangles) faces.emplace_back(t[0], t[1], t[2]);
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, faces);
    openvdb::util::NullInterrupter never;
    const auto voxels = static_cast<float>(half_width / transform.voxelSize()[0]);
    return openvdb::tools::meshToVolume<FloatGrid>(never, adapter, transform, voxels, voxels, flags, nearest);
}

// A narrow band: the distance of each voxel, initially unsigned, and its nearest triangle.
struct Band {
    FloatGrid::Ptr distance;
    Int32Grid::Ptr nearest;
    std::vector<Leaf*> leaves;  // leaves of the distances
    double voxel;

    Band(FloatGrid::Ptr distances, Int32Grid::Ptr triangles)
        : distance(std::move(distances)), nearest(std::move(triangles)), voxel(distance->voxelSize()[0])
    {
        find_leaves();
    }

    void find_leaves()
    {
        leaves.clear();
        distance->tree().getNodes(leaves);
    }
};

Band measured_band(const MeshBlocks& measured)
{
    using NearestLeaf = openvdb::Int32Tree::LeafNodeType;
    const VoxelBlocks& blocks = measured.blocks;
    const auto nearest = Int32Grid::create(no_triangle);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        const VoxelBlocks::BlockCoord lowest = VoxelBlocks::edge * blocks.coords[b];
        auto leaf = std::make_unique<NearestLeaf>(Coord(lowest.x(), lowest.y(), lowest.z()), no_triangle, true);
        std::copy_n(measured.nearest.data() + b * VoxelBlocks::voxels, VoxelBlocks::voxels, leaf->buffer().data());
        nearest->tree().addLeaf(leaf.release());
    }
    return {tree_of(blocks), nearest};
}

// A shorter distance (m) of a voxel, and its triangle.
struct Update {
    Coord voxel;
    float distance;
    std::int32_t nearest;
};

// Calls f for the 26 neighbours of a voxel, or only the six across its faces, with their distances in voxels.
template <class F>
void for_each_neighbour(const Coord& voxel, bool across_faces, const F& f)
{
    static constexpr double far[4] = {0, 1, std::numbers::sqrt2, std::numbers::sqrt3};
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z) {
                const int steps = std::abs(x) + std::abs(y) + std::abs(z);
                if (steps == 1 || (steps > 1 && !across_faces)) f(voxel.offsetBy(x, y, z), far[steps]);
            }
}

// Runs a Jacobi iteration: calls `improve(voxel, phi, accessor, nearest, updates)` for all active voxels, applies the
// updates, and repeats around the changed voxels until nothing changes. A voxel depends only on the previous round, so
// the result is independent of the order. Distances only shrink.
template <class Improve>
void improve_until_done(Band& band, const Improve& improve)
{
    constexpr std::size_t part = 512;
    FloatGrid::Accessor distance = band.distance->getAccessor();
    Int32Grid::Accessor nearest = band.nearest->getAccessor();
    std::vector<Coord> pending;
    for (const Leaf* leaf : band.leaves)
        for (auto it = leaf->cbeginValueOn(); it; ++it) pending.push_back(it.getCoord());
    std::vector<std::vector<Update>> updates;
    while (!pending.empty()) {
        updates.resize((pending.size() + part - 1) / part);
        for_each_chunk(
            pending.size(),
            [&](std::size_t begin, std::size_t end) {
                std::vector<Update>& found = updates[begin / part];
                found.clear();
                const Accessor now(band.distance->constTree());
                const NearestAccessor nearest_now(band.nearest->constTree());
                for (std::size_t i = begin; i < end; ++i)
                    improve(pending[i], now.getValue(pending[i]), now, nearest_now, found);
            },
            part);

        pending.clear();
        for (const auto& of_part : updates)
            for (const Update& update : of_part) {
                if (std::abs(update.distance) >= std::abs(distance.getValue(update.voxel))) continue;
                distance.setValue(update.voxel, update.distance);
                nearest.setValue(update.voxel, update.nearest);
                pending.push_back(update.voxel);
                for_each_neighbour(update.voxel, /*across_faces=*/false,
                                   [&](const Coord& other, double) { pending.push_back(other); });
            }
        std::erase_if(pending, [&](const Coord& voxel) { return !distance.isValueOn(voxel); });
        std::sort(pending.begin(), pending.end());
        pending.erase(std::unique(pending.begin(), pending.end()), pending.end());
    }
    band.find_leaves();
}

// Gives a voxel the triangle of a neighbour if that is nearer than its own, and adds missing voxels to the band. Only
// neighbours nearer to the mesh are considered.
void shorten_distances(Band& band, const InVoxels& mesh)
{
    std::vector<Prism> prisms;
    prisms.reserve(mesh.mesh->triangles.size());
    for (std::size_t t = 0; t < mesh.mesh->triangles.size(); ++t) {
        const auto triangle = static_cast<std::int32_t>(t);
        prisms.emplace_back(mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2));
    }
    // The least improvement that counts, m. The rounding to single precision is 1e-6 of a voxel, and half the
    // improvement would still end the rounds.
    const double worth = 1e-3 * band.voxel;
    // OpenVDB tests each triangle against the voxels within √3/2 of it and all their neighbours, so distances below
    // this (m) are exact.
    const double exact = 1.5 * band.voxel;
    const double half_width = band.distance->background();
    improve_until_done(band, [&](const Coord& voxel, double phi, const Accessor& accessor,
                                 const NearestAccessor& nearest, std::vector<Update>& updates) {
        const std::int32_t own = nearest.getValue(voxel);
        double best = phi;
        std::int32_t triangle = own, tried = own;
        for_each_neighbour(voxel, phi < exact, [&](const Coord& other, double far) {
            const double there = accessor.getValue(other);
            if (there >= half_width) {
                if (phi + far * band.voxel < half_width)
                    updates.push_back({other, static_cast<float>(mesh.distance_to(own, other) * band.voxel), own});
                return;
            }
            if (there >= best || phi < exact) return;
            const std::int32_t candidate = nearest.getValue(other);
            if (candidate == tried || candidate == triangle) return;
            tried = candidate;
            const double enough = (best - worth) / band.voxel;
            if (prisms[candidate].square_at_least(center(voxel)) >= enough * enough) return;
            const double distance = mesh.distance_to(candidate, voxel) * band.voxel;
            if (distance >= best - worth) return;
            best = distance;
            triangle = candidate;
        });
        if (triangle != own) updates.push_back({voxel, static_cast<float>(best), triangle});
    });
}

Band corrected_band(const InVoxels& mesh, const openvdb::math::Transform& transform, double half_width)
{
    const auto nearest = Int32Grid::create(no_triangle);
    Band band(by_openvdb(*mesh.mesh, transform, half_width, openvdb::tools::UNSIGNED_DISTANCE_FIELD, nearest.get()),
              nearest);
    shorten_distances(band, mesh);
    return band;
}

// Returns true if any faces lie inside.
bool sign_by_windings(Band& band, const RayCrossings& faces)
{
    std::atomic<bool> overlap = false;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, band.leaves.size()), [&](const auto& range) {
        std::vector<RayCrossings::Crossing> crossings;
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
            const Coord lowest = band.leaves[i]->origin();
            const std::span<float, VoxelBlocks::voxels> values(band.leaves[i]->buffer().data(), VoxelBlocks::voxels);
            if (sign_by_windings(faces, {lowest.x(), lowest.y(), lowest.z()}, values, crossings)) overlap = true;
        }
    });
    return overlap;
}

// Removes the influence of faces inside a mesh of overlapping pieces, which are not part of the surface: voxels whose
// nearest face is such a face take the nearest surface face from their neighbours, or count as deeper than the band.
void ignore_faces_inside(Band& band, const InVoxels& mesh, const RayCrossings& faces)
{
    // Seen from inside, the nearest point of a face is on the surface if the position just past it is outside. For a
    // voxel on the face itself, either side may be outside.
    const auto is_surface = [&](std::int32_t triangle, const Coord& voxel) {
        constexpr double offset = 1e-3;  // voxels; positions have an error of about 1e-4
        const auto outside = [&](const Vec3d& P) { return faces.from(P).windings == 0; };
        const Vec3d there = mesh.nearest_on(triangle, voxel), to_face = there - center(voxel);
        if (to_face.norm() > offset) return outside(there + to_face * (offset / to_face.norm()));
        const Vec3d step = mesh.normal(triangle) * offset;
        return outside(there + step) || outside(there - step);
    };
    const auto half_width = band.distance->background();
    tbb::parallel_for(std::size_t{0}, band.leaves.size(), [&](std::size_t i) {
        const NearestAccessor nearest(band.nearest->constTree());
        for (auto it = band.leaves[i]->beginValueOn(); it; ++it)
            if (std::signbit(*it) && !is_surface(nearest.getValue(it.getCoord()), it.getCoord()))
                it.setValue(-half_width);
    });
    improve_until_done(band, [&](const Coord& voxel, double phi, const Accessor& accessor,
                                 const NearestAccessor& nearest, std::vector<Update>& updates) {
        if (phi > -half_width) return;
        double best = half_width;
        std::int32_t triangle = -1;
        for_each_neighbour(voxel, /*across_faces=*/false, [&](const Coord& other, double) {
            const float there = accessor.getValue(other);
            if (!(there < half_width && there > -half_width)) return;
            const std::int32_t candidate = nearest.getValue(other);
            const double distance = mesh.distance_to(candidate, voxel) * band.voxel;
            if (distance >= best || !is_surface(candidate, voxel)) return;
            best = distance;
            triangle = candidate;
        });
        if (triangle >= 0) updates.push_back({voxel, static_cast<float>(-best), triangle});
    });
    for (Leaf* leaf : band.leaves)
        for (auto it = leaf->beginValueOn(); it; ++it)
            if (*it <= -half_width) it.setValueOff();
}

LevelSetGridPtr of_mesh(const Mesh& world, bool balanced, const VoxelFrame& frame, double half_width,
                        const MeshBlocks* measured)
{
    initialize_openvdb();
    const InVoxels mesh{measured ? measured->mesh : in_voxels(world, frame)};
    const auto transform = transform_of(frame);
    if (!balanced)
        return level_set_grid(
            by_openvdb(*mesh.mesh, *transform, half_width, openvdb::tools::DISABLE_RENORMALIZATION, nullptr));
    Band band = measured ? measured_band(*measured) : corrected_band(mesh, *transform, half_width);
    const RayCrossings faces(mesh.mesh);
    if (measured ? measured->overlap : sign_by_windings(band, faces)) ignore_faces_inside(band, mesh, faces);
    return level_set_grid(band.distance);
}

RAPID_DEFINE(grid_of_mesh, of_mesh);

}  // namespace
}  // namespace rapid
