// Births in the volume of a mesh.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/shapes/mesh/ray_crossings.h"
#include "runtime/shapes/scatter/scatter_in_cells.h"

namespace rapid {
namespace {

// Tests for a nonzero winding number or, if faces are inconsistently oriented, an odd number of crossings.
struct InMesh {
    RayCrossings crossings;
    bool by_winding;

    bool operator()(const Vec3f& P) const
    {
        const RayCrossings::Count count = crossings.from(P.cast<double>());
        return by_winding ? count.windings != 0 : count.faces % 2 != 0;
    }
};

// Returns the nearest cell. An axis in which the mesh is flat has a single cell.
Eigen::Vector3i cell_at(const ScatterCells& cells, const Vec3d& P)
{
    Eigen::Vector3i cell = Eigen::Vector3i::Zero();
    for (int k = 0; k < 3; ++k)
        if (cells.edge[k] > 0)
            cell[k] = std::clamp(static_cast<int>(std::floor((P[k] - cells.origin[k]) / cells.edge[k])), 0,
                                 cells.counts[k] - 1);
    return cell;
}

// Classifies the cells: those that a face touches are partly inside, and each other cell is wholly inside or outside
// like its centre.
ScatterCells cells_of(const Mesh& mesh, const InMesh& inside)
{
    constexpr double about = 32768;  // cells in the box of a compact mesh
    constexpr double most = 256;     // along an axis
    const Box3d bounds = mesh.bounds().cast<double>();
    const double edge = std::max(std::cbrt(bounds.volume() / about), bounds.sizes().maxCoeff() / most);
    ScatterCells cells;
    cells.origin = bounds.min();
    cells.counts = (bounds.sizes() / edge).array().ceil().max(1).cast<int>();
    cells.edge = bounds.sizes().cwiseQuotient(cells.counts.cast<double>());

    std::vector<std::uint8_t> touched(cells.counts.prod(), 0);
    const Vec3d slack = 1e-6 * cells.edge;  // a face on the border of two cells touches both
    for (const Mesh::Triangle& t : mesh.triangles) {
        const Vec3d a = mesh.positions[t[0]].cast<double>(), b = mesh.positions[t[1]].cast<double>();
        const Vec3d c = mesh.positions[t[2]].cast<double>();
        const Eigen::Vector3i from = cell_at(cells, a.cwiseMin(b).cwiseMin(c) - slack);
        const Eigen::Vector3i to = cell_at(cells, a.cwiseMax(b).cwiseMax(c) + slack);
        const Vec3d normal = (b - a).cross(c - a);
        const double reach = normal.cwiseAbs().dot(cells.edge / 2 + slack);  // extent of a cell along the normal
        for (int x = from.x(); x <= to.x(); ++x)
            for (int y = from.y(); y <= to.y(); ++y)
                for (int z = from.z(); z <= to.z(); ++z) {
                    const Vec3d middle =
                        cells.origin + (Vec3d(x, y, z) + Vec3d::Constant(0.5)).cwiseProduct(cells.edge);
                    if (std::abs(normal.dot(middle - a)) <= reach)
                        touched[(std::size_t(x) * cells.counts.y() + y) * cells.counts.z() + z] = 1;
                }
    }
    std::vector<std::uint32_t> partly;
    for (std::uint32_t cell = 0; cell < touched.size(); ++cell) {
        if (touched[cell])
            partly.push_back(cell);
        else if (inside((cells.low(cell) + cells.edge / 2).cast<float>()))
            cells.cells.push_back(cell);
    }
    cells.whole = cells.cells.size();
    cells.cells.insert(cells.cells.end(), partly.begin(), partly.end());
    return cells;
}

}  // namespace

ScatterPtr scatter_in_volume(const MeshPtr& mesh)
{
    const std::string what = fmt::format("mesh \"{}\"", mesh->name);
    const Mesh::Openness open = mesh->openness();
    if (open.odd_edges > 0)
        throw Error(fmt::format(
            "{} encloses no volume: {} of its edges have an odd number of faces; close it, or use its surface", what,
            open.odd_edges));
    InMesh inside{RayCrossings(mesh), open.unbalanced_edges == 0};
    ScatterCells cells = cells_of(*mesh, inside);
    // Pieces of opposite orientation reduce the signed volume, but not the number of cells that are wholly inside.
    const double volume = std::max(std::abs(mesh->signed_volume()), double(cells.whole) * cells.edge.prod());
    if (!(volume > 0))
        throw Error(fmt::format("{} has {} faces but no volume; use its surface", what, mesh->triangles.size()));
    return std::make_shared<ScatterInCells<InMesh>>(std::move(cells), std::move(inside), volume, what);
}

}  // namespace rapid
