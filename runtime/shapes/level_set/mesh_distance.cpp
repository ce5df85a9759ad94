// The signed distance from a mesh, on a grid.
//
// The distance is that to the nearest triangle (mesh_band.h), the sign that of the winding number. A mesh without one
// has OpenVDB's distances and signs.
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <span>

#include "runtime/parallel.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/mesh_band.h"
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

Vec3d center(const Coord& voxel) { return {double(voxel.x()), double(voxel.y()), double(voxel.z())}; }

// A mesh in voxels.
struct InVoxels {
    std::shared_ptr<Mesh> mesh = std::make_shared<Mesh>();

    InVoxels(const Mesh& world, const openvdb::math::Transform& transform)
    {
        mesh->triangles = world.triangles;
        mesh->positions.reserve(world.positions.size());
        for (const Vec3f& P : world.positions) {
            const openvdb::Vec3d there = transform.worldToIndex(openvdb::Vec3d(P.x(), P.y(), P.z()));
            mesh->positions.push_back(Vec3d(there.x(), there.y(), there.z()).cast<float>());
        }
    }

    Vec3d corner(std::int32_t triangle, int k) const
    {
        return mesh->positions[mesh->triangles[triangle][k]].cast<double>();
    }
    Vec3d nearest_on(std::int32_t triangle, const Coord& voxel) const
    {
        const Vec3d a = corner(triangle, 0), ab = corner(triangle, 1) - a, ac = corner(triangle, 2) - a;
        const auto [b, c] = nearest_weights(center(voxel), a, corner(triangle, 1), corner(triangle, 2));
        return a + b * ab + c * ac;
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

// A narrow band: the distance of each voxel, at first without a sign, and the nearest triangle.
struct Band {
    using Nearest = std::array<std::int32_t, MeshBand::voxels>;

    FloatGrid::Ptr distance;
    std::vector<Leaf*> leaves;
    std::vector<Nearest> nearest;  // of each leaf; -1 beyond the band
    double voxel;

    Band(const InVoxels& mesh, const openvdb::math::Transform& transform, double half_width)
        : distance(FloatGrid::create(static_cast<float>(half_width))), voxel(transform.voxelSize()[0])
    {
        static_assert(MeshBand::block == Leaf::DIM && MeshBand::voxels == Leaf::SIZE);
        distance->setTransform(transform.copy());
        const MeshBand band(*mesh.mesh, half_width / voxel);
        leaves.resize(band.size());
        nearest.resize(band.size());
        for_each_chunk(
            band.size(),
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t b = begin; b < end; ++b) leaves[b] = measured(band, b);
            },
            8);
        std::size_t kept = 0;
        for (std::size_t b = 0; b < leaves.size(); ++b) {
            if (!leaves[b]) continue;
            distance->tree().addLeaf(leaves[b]);
            if (kept != b) leaves[kept] = leaves[b], nearest[kept] = nearest[b];
            ++kept;
        }
        leaves.resize(kept);
        nearest.resize(kept);
    }

    Int32Grid::Ptr nearest_grid() const
    {
        auto grid = Int32Grid::create(-1);
        for (std::size_t i = 0; i < leaves.size(); ++i) {
            auto* leaf = new Int32Grid::TreeType::LeafNodeType(leaves[i]->origin(), -1, true);
            std::copy(nearest[i].begin(), nearest[i].end(), leaf->buffer().data());
            grid->tree().addLeaf(leaf);
        }
        return grid;
    }

private:
    // Null where no voxel of the block is in the band.
    Leaf* measured(const MeshBand& band, std::size_t b)
    {
        std::array<float, MeshBand::voxels> voxels;
        if (band.measure(b, voxels, nearest[b]) == 0) return nullptr;
        const Eigen::Vector3i origin = band.origin(b);
        auto* leaf = new Leaf(Coord(origin.x(), origin.y(), origin.z()), distance->background(), false);
        float* values = leaf->buffer().data();
        for (std::size_t v = 0; v < voxels.size(); ++v) {
            if (nearest[b][v] < 0) continue;
            values[v] = voxels[v] * static_cast<float>(voxel);
            leaf->setValueOn(static_cast<openvdb::Index>(v));
        }
        return leaf;
    }
};

// A better distance (m) of a voxel, and its triangle.
struct Update {
    Coord voxel;
    float distance;
    std::int32_t nearest;
};

template <class F>
void for_each_neighbour(const Coord& voxel, const F& f)
{
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z)
                if (x != 0 || y != 0 || z != 0) f(voxel.offsetBy(x, y, z));
}

// Jacobi iteration: calls `improve(voxel, phi, accessor, nearest, updates)` for all active voxels, applies the updates,
// and repeats it around the voxels that have changed, until there are none. A voxel depends on the previous round
// alone, never on an order. Distances only shrink.
template <class Improve>
void improve_until_done(FloatGrid& distance, Int32Grid& nearest, std::span<Leaf* const> leaves, const Improve& improve)
{
    constexpr std::size_t part = 512;
    FloatGrid::Accessor distances = distance.getAccessor();
    Int32Grid::Accessor triangles = nearest.getAccessor();
    std::vector<Coord> asked;
    for (const Leaf* leaf : leaves)
        for (auto it = leaf->cbeginValueOn(); it; ++it) asked.push_back(it.getCoord());
    std::vector<std::vector<Update>> updates;
    while (!asked.empty()) {
        updates.resize((asked.size() + part - 1) / part);
        for_each_chunk(
            asked.size(),
            [&](std::size_t begin, std::size_t end) {
                std::vector<Update>& found = updates[begin / part];
                found.clear();
                const Accessor now(distance.constTree());
                const NearestAccessor nearest_now(nearest.constTree());
                for (std::size_t i = begin; i < end; ++i)
                    improve(asked[i], now.getValue(asked[i]), now, nearest_now, found);
            },
            part);

        asked.clear();
        for (const auto& of_part : updates)
            for (const Update& update : of_part) {
                if (std::abs(update.distance) >= std::abs(distances.getValue(update.voxel))) continue;
                distances.setValue(update.voxel, update.distance);
                triangles.setValue(update.voxel, update.nearest);
                asked.push_back(update.voxel);
                for_each_neighbour(update.voxel, [&](const Coord& other) { asked.push_back(other); });
            }
        std::erase_if(asked, [&](const Coord& voxel) { return !distances.isValueOn(voxel); });
        std::sort(asked.begin(), asked.end());
        asked.erase(std::unique(asked.begin(), asked.end()), asked.end());
    }
}

// Negative where the winding number is not 0, by whole rows of voxels along x. Returns whether any faces lie inside:
// with a winding number other than 0 on both their sides.
bool sign_by_windings(Band& band, const RayCrossings& faces)
{
    std::atomic<bool> overlaps = false;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, band.leaves.size()), [&](const auto& range) {
        std::vector<RayCrossings::Crossing> crossings;
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
            Leaf& leaf = *band.leaves[i];
            const Coord origin = leaf.origin();
            float* values = leaf.buffer().data();
            for (int y = 0; y < BakedGrid::block; ++y)
                for (int z = 0; z < BakedGrid::block; ++z) {
                    faces.along_x(origin.y() + y, origin.z() + z, crossings);
                    int windings = 0;
                    auto beyond = crossings.rbegin();
                    for (int x = BakedGrid::block - 1; x >= 0; --x) {
                        for (; beyond != crossings.rend() && beyond->x > origin.x() + x; ++beyond) {
                            overlaps = overlaps || (windings != 0 && windings + beyond->turn != 0);
                            windings += beyond->turn;
                        }
                        float& value = values[Leaf::coordToOffset(Coord(x, y, z))];
                        value = std::copysign(value, windings != 0 ? -1.0f : 1.0f);
                    }
                }
        }
    });
    return overlaps;
}

// Where pieces of a mesh overlap, the faces inside are no surface: voxels with such a nearest face take the nearest
// other one, from their neighbours, or lie deeper than the band.
void ignore_faces_inside(Band& band, const InVoxels& mesh, const RayCrossings& faces)
{
    // Seen from inside, the nearest point of a face is on the surface if it is outside just behind it; for a voxel on
    // the face, on either side of it.
    const auto is_surface = [&](std::int32_t triangle, const Coord& voxel) {
        constexpr double behind = 1e-3;  // voxels; the positions have about 1e-4
        const auto outside = [&](const Vec3d& P) { return faces.from(P).windings == 0; };
        const Vec3d there = mesh.nearest_on(triangle, voxel), to_face = there - center(voxel);
        if (to_face.norm() > behind) return outside(there + to_face * (behind / to_face.norm()));
        const Vec3d step = mesh.normal(triangle) * behind;
        return outside(there + step) || outside(there - step);
    };
    const auto half_width = band.distance->background();
    tbb::parallel_for(std::size_t{0}, band.leaves.size(), [&](std::size_t i) {
        for (auto it = band.leaves[i]->beginValueOn(); it; ++it)
            if (std::signbit(*it) && !is_surface(band.nearest[i][it.pos()], it.getCoord())) it.setValue(-half_width);
    });
    const Int32Grid::Ptr nearest_grid = band.nearest_grid();
    improve_until_done(*band.distance, *nearest_grid, band.leaves,
                       [&](const Coord& voxel, double phi, const Accessor& accessor, const NearestAccessor& nearest,
                           std::vector<Update>& updates) {
                           if (phi > -half_width) return;
                           double best = half_width;
                           std::int32_t triangle = -1;
                           for_each_neighbour(voxel, [&](const Coord& other) {
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

FloatGrid::Ptr by_openvdb(const Mesh& mesh, const openvdb::math::Transform& transform, double half_width)
{
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> faces;
    for (const Vec3f& P : mesh.positions) points.emplace_back(P.x(), P.y(), P.z());
    for (const Mesh::Triangle& t : mesh.triangles) faces.emplace_back(t[0], t[1], t[2]);
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, faces);
    openvdb::util::NullInterrupter never;
    const auto voxels = static_cast<float>(half_width / transform.voxelSize()[0]);
    return openvdb::tools::meshToVolume<FloatGrid>(never, adapter, transform, voxels, voxels,
                                                   openvdb::tools::DISABLE_RENORMALIZATION);
}

}  // namespace

FloatGrid::Ptr signed_distance(const Mesh& world, bool balanced, const openvdb::math::Transform& transform,
                               double half_width)
{
    const InVoxels mesh(world, transform);
    if (!balanced) return by_openvdb(*mesh.mesh, transform, half_width);
    Band band(mesh, transform, half_width);
    const RayCrossings faces(mesh.mesh);
    if (sign_by_windings(band, faces)) ignore_faces_inside(band, mesh, faces);
    openvdb::tools::signedFloodFill(band.distance->tree());
    band.distance->setGridClass(openvdb::GRID_LEVEL_SET);
    return band.distance;
}

}  // namespace rapid
