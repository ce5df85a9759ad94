// rapid.fog: volumes of a density.
#include "bindings/host/maker.h"
#include "runtime/shapes/level_set/density_grid.h"

namespace rapid {
namespace {

struct ReadFog {
    std::string path, grid;

    static Maker declare()
    {
        return maker<ReadFog>("fog.read", "Reads a fog, in which points are born by density, from a .vdb file.")
            .param(&ReadFog::path, "path", Value(), any_number(), "", "relative to the graph file")
            .required()
            .param(&ReadFog::grid, "grid", Value(), any_number(), "",
                   "its name; the only fog of floats, when not given");
    }
    ObjectPtr make(MakeContext& context) const { return read_density_grid(context.resolve(path), grid); }
};
RAPID_MAKER(ReadFog);

}  // namespace
}  // namespace rapid
