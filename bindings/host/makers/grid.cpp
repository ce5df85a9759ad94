// rapid.grid: vector fields.
#include <fmt/format.h>

#include "bindings/host/maker.h"
#include "bindings/host/makers/grid_files.h"
#include "bindings/host/makers/points_of_grid.h"
#include "bindings/host/makers/written_vdb.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/write_grids.h"

namespace rapid {
namespace {

struct ReadGrid : GridFiles {
    static Maker declare()
    {
        auto declaration = maker<ReadGrid>("grid.read", "Reads a grid of vectors from a .vdb file.");
        return GridFiles::declare(declaration, "name of the grid; the default is the only grid of vectors in the file");
    }
    ObjectPtr make(MakeContext& context) const { return make_with<VectorGrid>(context, read_vector_grid); }
};
RAPID_MAKER(ReadGrid);

struct GridFromPoints : PointsOfGrid {
    std::string attribute;

    static Maker declare()
    {
        auto declaration = maker<GridFromPoints>("grid.from_points",
                                                 "Returns a grid of the weighted mean of a vec3 attribute of points.");
        PointsOfGrid::declare(declaration);
        declaration.param(&GridFromPoints::attribute, "attribute", std::string("v"), any_number(), "",
                          "vec3 attribute");
        return declaration;
    }
    ObjectPtr make(MakeContext&) const
    {
        const PointSet& set = points->points;
        const Column<Vec3f>* column = set.find<Vec3f>(attribute);
        if (!column) {
            std::vector<std::string> vectors;
            for (const auto& [name, any] : set.columns())
                if (type_of(any) == AttributeType::Vec3) vectors.push_back(name);
            throw Error(fmt::format("attribute = \"{}\": the points have no vec3 with this name{}", attribute,
                                    did_you_mean(attribute, vectors)));
        }
        std::vector<Vec3f> vectors(set.size());
        for (std::size_t i = 0; i < vectors.size(); ++i) vectors[i] = (*column)[i];
        SpreadPoints those = spread();
        those.vectors = vectors;
        return vectors_of_points(those);
    }
};
RAPID_MAKER(GridFromPoints);

struct WriteGrids {
    std::string path;
    std::map<std::string, Value> grids;

    static Maker declare()
    {
        return maker<WriteGrids>("grid.write", "Writes fogs and grids of vectors to a .vdb file, in a run.")
            .param(&WriteGrids::path, "path", Value(), any_number(), "", "path, relative to the current folder")
            .required()
            .param(&WriteGrids::grids, "grids", Value(), any_number(), "",
                   "grids by their name in the file, { density = fog, v = grid }")
            .required();
    }
    ObjectPtr make(MakeContext& context) const
    {
        std::map<std::string, ObjectPtr> objects;
        for (const auto& [name, value] : grids) {
            const ObjectPtr* object = value.get<ObjectPtr>();
            if (!object || !(std::dynamic_pointer_cast<const VectorGrid>(*object) ||
                             std::dynamic_pointer_cast<const DensityGrid>(*object)))
                throw Error(fmt::format("{} = {}; it must be a fog or a grid of vectors", name, describe(value)));
            objects[name] = *object;
        }
        if (objects.empty()) throw Error("there is no grid to write; give a table { NAME = grid }");
        require_vdb(path);
        if (context.may_write) write_grids(path, objects);
        return objects.begin()->second;
    }
};
RAPID_MAKER(WriteGrids);

// The parameter `at`: the values of the function at each node, evaluated by lua/rapid.lua.
struct PositionFunction {
    static constexpr std::string_view param_type = "function of a place";

    std::vector<double> values;  // three per node, z fastest
};

void read_value(const Param& param, const Value& value, PositionFunction& function)
{
    rapid::read_value(param, value, function.values);
}

struct GridFrom {
    PositionFunction at;
    Vec3d size, center, origin;
    std::vector<double> nodes;
    double voxel;

    static Maker declare()
    {
        return maker<GridFrom>("grid.from", "Returns a grid of vectors from a function of the position.")
            .param(&GridFrom::at, "at", Value(), any_number(), "",
                   "function of the position, called once at each node of the lattice")
            .required()
            .param(&GridFrom::size, "size", Vec3d(1, 1, 1), any_number(), "m", "full edge lengths")
            .param(&GridFrom::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre")
            .param(&GridFrom::voxel, "voxel", 0.1, at_least(min_voxel), "m", "distance between nodes")
            .param(&GridFrom::origin, "origin", Value(), any_number(), "m", "lowest corner")
            .internal()
            .param(&GridFrom::nodes, "nodes", Value(), at_least(1), "", "number of nodes along each axis")
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
