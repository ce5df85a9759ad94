// rapid.fog: density volumes.
#include "bindings/host/maker.h"
#include "bindings/host/makers/grid_files.h"
#include "bindings/host/makers/points_of_grid.h"

namespace rapid {
namespace {

struct ReadFog : GridFiles {
    static Maker declare()
    {
        auto declaration =
            maker<ReadFog>("fog.read", "Reads a fog, which emits points by its density, from a .vdb file.");
        return GridFiles::declare(declaration, "name of the grid; the default is the only grid of floats in the file");
    }
    ObjectPtr make(MakeContext& context) const { return make_with<DensityGrid>(context, read_density_grid); }
};
RAPID_MAKER(ReadFog);

struct FogFromPoints : PointsOfGrid {
    static Maker declare()
    {
        auto declaration =
            maker<FogFromPoints>("fog.from_points", "Returns the density of points: their weights per volume.");
        PointsOfGrid::declare(declaration);
        return declaration;
    }
    ObjectPtr make(MakeContext&) const { return density_of_points(spread()); }
};
RAPID_MAKER(FogFromPoints);

}  // namespace
}  // namespace rapid
