// rapid.grid: vector fields.
#include <fmt/format.h>

#include "bindings/host/maker.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {
namespace {

struct ReadGrid {
    std::string path, grid;

    static Maker declare()
    {
        return maker<ReadGrid>("grid.read", "Reads a grid of vectors from a .vdb file.")
            .param(&ReadGrid::path, "path", Value(), any_number(), "", "relative to the graph file")
            .required()
            .param(&ReadGrid::grid, "grid", Value(), any_number(), "",
                   "its name; the only grid of vectors, when not given");
    }
    ObjectPtr make(MakeContext& context) const { return read_vector_grid(context.resolve(path), grid); }
};
RAPID_MAKER(ReadGrid);

// lua/rapid.lua has evaluated the function at each node.
struct GridOfValues {
    Vec3d origin;
    double voxel;
    std::vector<double> nodes, values;

    static Maker declare()
    {
        return maker<GridOfValues>("grid.of_values", "A lattice of vectors.")
            .param(&GridOfValues::origin, "origin", Value(), any_number(), "m", "its lowest corner")
            .required()
            .param(&GridOfValues::voxel, "voxel", Value(), above(0), "m", "between nodes")
            .required()
            .param(&GridOfValues::nodes, "nodes", Value(), at_least(1), "", "along each axis")
            .required()
            .param(&GridOfValues::values, "values", Value(), any_number(), "", "three a node, z fastest")
            .required();
    }
    ObjectPtr make(MakeContext&) const
    {
        std::vector<Vec3f> vectors(values.size() / 3);
        for (std::size_t i = 0; i < vectors.size(); ++i)
            vectors[i] = Vec3d(values[3 * i], values[3 * i + 1], values[3 * i + 2]).cast<float>();
        return make_vector_grid(origin, voxel, Vec3d(nodes[0], nodes[1], nodes[2]).cast<int>(), vectors);
    }
};
RAPID_MAKER(GridOfValues);

}  // namespace
}  // namespace rapid
