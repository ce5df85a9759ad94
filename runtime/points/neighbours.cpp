#include "runtime/points/neighbours.h"

#include <fmt/format.h>
#include <openvdb/tools/PointIndexGrid.h>

#include <algorithm>

#include "runtime/error.h"

namespace rapid {
namespace {

// A list of points, as OpenVDB takes it. Its maps refuse voxels below 1e-5 m: positions are in radii.
struct PointList {
    using PosType = openvdb::Vec3d;

    std::vector<Vec3f> P;
    double radius;

    std::size_t size() const { return P.size(); }
    void getPos(std::size_t i, PosType& x) const { x = PosType(P[i].x(), P[i].y(), P[i].z()) / radius; }
};

using openvdb::tools::PointIndexGrid;

class IndexedNeighbours final : public Neighbours {
public:
    explicit IndexedNeighbours(PointList points)
        : points_(std::move(points)),
          index_(openvdb::tools::createPointIndexGrid<PointIndexGrid>(points_, /*voxel=*/1.0))
    {
    }

    void find(const Vec3d& X, std::vector<std::uint32_t>& indices) const override
    {
        indices.clear();
        auto accessor = index_->getConstAccessor();
        const double radius = points_.radius;
        const openvdb::Vec3d at = openvdb::Vec3d(X.x(), X.y(), X.z()) / radius;
        const auto& transform = index_->transform();
        const openvdb::Vec3d reach(1 + 0x1p-20);
        openvdb::tools::PointIndexIterator<> near(openvdb::CoordBBox(transform.worldToIndexCellCentered(at - reach),
                                                                     transform.worldToIndexCellCentered(at + reach)),
                                                  accessor);
        for (; near; ++near)
            if ((points_.P[*near].cast<double>() - X).squaredNorm() <= radius * radius) indices.push_back(*near);
        std::sort(indices.begin(), indices.end());
    }

private:
    PointList points_;
    PointIndexGrid::Ptr index_;
};

std::unique_ptr<const Neighbours> make(std::span<const Vec3f> P, double radius)
{
    float largest = 0;
    for (const Vec3f& x : P) largest = std::max(largest, x.cwiseAbs().maxCoeff());
    if (!(radius > 0) || !(largest / radius < 0x1p30))
        throw Error(
            fmt::format("neighbours within {:g} m of points up to {:g} m from the origin; the radius must be "
                        "above 0, and above {:g} m there",
                        radius, largest, largest * 0x1p-30));
    return std::make_unique<IndexedNeighbours>(PointList{{P.begin(), P.end()}, radius});
}

const bool defined = index_neighbours.define(make);

}  // namespace
}  // namespace rapid
