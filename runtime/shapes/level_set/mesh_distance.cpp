// The signed distance from a mesh, on a grid.
//
// OpenVDB finds the voxels near a mesh and their distances. Two errors that make points visibly sink into the surface
// are corrected here: the signs are wrong at some voxels next to the surface (dents of up to a third of a voxel, 2 to 3
// % of a thin body's volume at ten voxels across), and beyond two voxels the nearest triangle may be wrong (up to 0.7
// of a voxel).
#include <openvdb/math/Proximity.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "runtime/parallel.h"
#include "runtime/shapes/level_set/level_set_grid.h"
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

// The plane of a triangle and those through its edges perpendicular to it: a bound of the distance in a few
// multiplications. Beside an edge it is the distance, past a corner less.
class Prism {
public:
    Prism(const openvdb::Vec3d& a, const openvdb::Vec3d& b, const openvdb::Vec3d& c)
        : up_((b - a).cross(c - a).unitSafe()), height_(up_.dot(a))
    {
        const openvdb::Vec3d corners[3] = {a, b, c};
        for (int k = 0; k < 3; ++k) {
            outward_[k] = (corners[(k + 1) % 3] - corners[k]).cross(up_).unitSafe();
            edge_[k] = outward_[k].dot(corners[k]);
        }
    }

    // The square of a lower bound on the distance.
    double square_at_least(const openvdb::Vec3d& P) const
    {
        const double h = up_.dot(P) - height_;
        double beside = 0;
        for (int k = 0; k < 3; ++k) beside = std::max(beside, outward_[k].dot(P) - edge_[k]);
        return h * h + beside * beside;
    }

private:
    openvdb::Vec3d up_, outward_[3];  // unit; zero where the triangle has no area
    double height_, edge_[3];
};

// The mesh in voxels, in OpenVDB's form and ours.
struct InVoxels {
    std::shared_ptr<Mesh> mesh = std::make_shared<Mesh>();
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> faces;
    std::vector<Prism> prisms;  // of the faces

    InVoxels(const Mesh& world, const openvdb::math::Transform& transform)
    {
        mesh->triangles = world.triangles;
        mesh->positions.reserve(world.positions.size());
        points.reserve(world.positions.size());
        faces.reserve(world.triangles.size());
        for (const Vec3f& P : world.positions) {
            points.emplace_back(transform.worldToIndex(openvdb::Vec3d(P.x(), P.y(), P.z())));
            mesh->positions.emplace_back(points.back().x(), points.back().y(), points.back().z());
        }
        prisms.reserve(world.triangles.size());
        for (const Mesh::Triangle& t : world.triangles) {
            faces.emplace_back(t[0], t[1], t[2]);
            prisms.emplace_back(points[t[0]], points[t[1]], points[t[2]]);
        }
    }

    openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter() const
    {
        return {points, faces};
    }
    openvdb::Vec3d nearest_on(openvdb::Int32 triangle, const Coord& voxel) const
    {
        const openvdb::Vec3I& face = faces[triangle];
        openvdb::Vec3d weights;
        return openvdb::math::closestPointOnTriangleToPoint(openvdb::Vec3d(points[face[0]]),
                                                            openvdb::Vec3d(points[face[1]]),
                                                            openvdb::Vec3d(points[face[2]]), voxel.asVec3d(), weights);
    }
    openvdb::Vec3d normal(openvdb::Int32 triangle) const
    {
        const openvdb::Vec3d a(points[faces[triangle][0]]), b(points[faces[triangle][1]]),
            c(points[faces[triangle][2]]);
        return (b - a).cross(c - a).unitSafe();
    }
    double distance_to(openvdb::Int32 triangle, const Coord& voxel) const
    {
        return (nearest_on(triangle, voxel) - voxel.asVec3d()).length();
    }
};

// A narrow band under correction: the distance of each voxel, and its nearest triangle.
struct Band {
    FloatGrid::Ptr distance;
    Int32Grid::Ptr nearest;
    std::vector<Leaf*> leaves;
    double voxel;

    void find_leaves()
    {
        leaves.clear();
        distance->tree().getNodes(leaves);
    }
};

// A better distance (m) of a voxel, and its triangle.
struct Update {
    Coord voxel;
    float distance;
    openvdb::Int32 nearest;
};

// The 26 neighbours of a voxel, or the six across its faces alone, and their distances, in voxels.
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

// Jacobi iteration: calls `improve(voxel, phi, accessor, nearest, updates)` for all active voxels, applies the updates,
// and repeats it around the voxels that have changed, until there are none. A voxel depends on the previous round
// alone, never on an order. Distances only shrink.
template <class Improve>
void improve_until_done(Band& band, const Improve& improve)
{
    constexpr std::size_t part = 512;
    FloatGrid::Accessor distance = band.distance->getAccessor();
    Int32Grid::Accessor nearest = band.nearest->getAccessor();
    std::vector<Coord> asked;
    for (const Leaf* leaf : band.leaves)
        for (auto it = leaf->cbeginValueOn(); it; ++it) asked.push_back(it.getCoord());
    std::vector<std::vector<Update>> updates;
    while (!asked.empty()) {
        updates.resize((asked.size() + part - 1) / part);
        for_each_chunk(
            asked.size(),
            [&](std::size_t begin, std::size_t end) {
                std::vector<Update>& found = updates[begin / part];
                found.clear();
                const Accessor now(band.distance->constTree());
                const NearestAccessor nearest_now(band.nearest->constTree());
                for (std::size_t i = begin; i < end; ++i)
                    improve(asked[i], now.getValue(asked[i]), now, nearest_now, found);
            },
            part);

        asked.clear();
        for (const auto& of_part : updates)
            for (const Update& update : of_part) {
                if (std::abs(update.distance) >= std::abs(distance.getValue(update.voxel))) continue;
                distance.setValue(update.voxel, update.distance);
                nearest.setValue(update.voxel, update.nearest);
                asked.push_back(update.voxel);
                for_each_neighbour(update.voxel, /*across_faces=*/false,
                                   [&](const Coord& other, double) { asked.push_back(other); });
            }
        std::erase_if(asked, [&](const Coord& voxel) { return !distance.isValueOn(voxel); });
        std::sort(asked.begin(), asked.end());
        asked.erase(std::unique(asked.begin(), asked.end()), asked.end());
    }
    band.find_leaves();
}

// A voxel takes the triangle of a neighbour nearer to the mesh if that is nearer to it too, and voxels missing from the
// band are added to it.
void shorten_distances(Band& band, const InVoxels& mesh)
{
    // m: the least improvement. Half of it would end the rounds, and the rounding to single precision is 1e-6 of a
    // voxel.
    const double worth = 1e-3 * band.voxel;
    // m: OpenVDB tests each triangle against the voxels within √3/2 of it and all their neighbours, so nearer ones are
    // right.
    const double exact = 1.5 * band.voxel;
    const double half_width = band.distance->background();
    improve_until_done(band, [&](const Coord& voxel, double phi, const Accessor& accessor,
                                 const NearestAccessor& nearest, std::vector<Update>& updates) {
        const openvdb::Int32 own = nearest.getValue(voxel);
        double best = phi;
        openvdb::Int32 triangle = own, tried = own;
        for_each_neighbour(voxel, phi < exact, [&](const Coord& other, double far) {
            const double there = accessor.getValue(other);
            if (there >= half_width) {
                if (phi + far * band.voxel < half_width)
                    updates.push_back({other, static_cast<float>(mesh.distance_to(own, other) * band.voxel), own});
                return;
            }
            if (there >= best || phi < exact) return;
            const openvdb::Int32 candidate = nearest.getValue(other);
            if (candidate == tried || candidate == triangle) return;
            tried = candidate;
            const double enough = (best - worth) / band.voxel;
            if (mesh.prisms[candidate].square_at_least(voxel.asVec3d()) >= enough * enough) return;
            const double distance = mesh.distance_to(candidate, voxel) * band.voxel;
            if (distance >= best - worth) return;
            best = distance;
            triangle = candidate;
        });
        if (triangle != own) updates.push_back({voxel, static_cast<float>(best), triangle});
    });
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
    const auto is_surface = [&](openvdb::Int32 triangle, const Coord& voxel) {
        constexpr double behind = 1e-3;  // voxels; the positions have about 1e-4
        const auto outside = [&](const openvdb::Vec3d& P) { return faces.from({P.x(), P.y(), P.z()}).windings == 0; };
        const openvdb::Vec3d there = mesh.nearest_on(triangle, voxel), to_face = there - voxel.asVec3d();
        if (to_face.length() > behind) return outside(there + to_face * (behind / to_face.length()));
        const openvdb::Vec3d step = mesh.normal(triangle) * behind;
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
        openvdb::Int32 triangle = -1;
        for_each_neighbour(voxel, /*across_faces=*/false, [&](const Coord& other, double) {
            const float there = accessor.getValue(other);
            if (!(there < half_width && there > -half_width)) return;
            const openvdb::Int32 candidate = nearest.getValue(other);
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

}  // namespace

FloatGrid::Ptr signed_distance(const Mesh& world, bool balanced, const openvdb::math::Transform& transform,
                               double half_width)
{
    openvdb::util::NullInterrupter never;
    const InVoxels mesh(world, transform);
    const double voxel = transform.voxelSize()[0];
    const auto voxels = static_cast<float>(half_width / voxel);
    if (!balanced)
        return openvdb::tools::meshToVolume<FloatGrid>(never, mesh.adapter(), transform, voxels, voxels,
                                                       openvdb::tools::DISABLE_RENORMALIZATION);

    Band band{nullptr, Int32Grid::create(openvdb::util::INVALID_IDX), {}, voxel};
    band.distance = openvdb::tools::meshToVolume<FloatGrid>(
        never, mesh.adapter(), transform, voxels, voxels, openvdb::tools::UNSIGNED_DISTANCE_FIELD, band.nearest.get());
    band.find_leaves();
    shorten_distances(band, mesh);
    const RayCrossings faces(mesh.mesh);
    if (sign_by_windings(band, faces)) ignore_faces_inside(band, mesh, faces);
    openvdb::tools::signedFloodFill(band.distance->tree());
    band.distance->setGridClass(openvdb::GRID_LEVEL_SET);
    return band.distance;
}

}  // namespace rapid
