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

// The parameter `at`: the values of the function at each node, which lua/rapid.lua has asked for.
struct PlaceFunction {
    static constexpr std::string_view param_type = "function of a place";

    std::vector<double> values;  // three a node, z fastest
};

void read_value(const Param& param, const Value& value, PlaceFunction& function)
{
    rapid::read_value(param, value, function.values);
}

struct GridFrom {
    PlaceFunction at;
    Vec3d size, center, origin;
    std::vector<double> nodes;
    double voxel;

    static Maker declare()
    {
        return maker<GridFrom>("grid.from", "A grid of vectors by a function of the place.")
            .param(&GridFrom::at, "at", Value(), any_number(), "", "asked at each node of the lattice, once")
            .required()
            .param(&GridFrom::size, "size", Vec3d(1, 1, 1), any_number(), "m", "full edge lengths")
            .param(&GridFrom::center, "center", Vec3d(0, 0, 0), any_number(), "m", "its middle")
            .param(&GridFrom::voxel, "voxel", 0.1, above(0), "m", "between nodes")
            .param(&GridFrom::origin, "origin", Value(), any_number(), "m", "the lowest corner")
            .internal()
            .param(&GridFrom::nodes, "nodes", Value(), at_least(1), "", "along each axis")
            .internal();
    }
    ObjectPtr make(MakeContext&) const
    {
        std::vector<Vec3f> vectors(at.values.size() / 3);
        for (std::size_t i = 0; i < vectors.size(); ++i)
            vectors[i] = Vec3d(at.values[3 * i], at.values[3 * i + 1], at.values[3 * i + 2]).cast<float>();
        return make_vector_grid(origin, voxel, Vec3d(nodes[0], nodes[1], nodes[2]).cast<int>(), vectors);
    }
};
RAPID_MAKER(GridFrom);

}  // namespace
}  // namespace rapid
