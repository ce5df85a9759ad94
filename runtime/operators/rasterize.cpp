// rasterize: writes the points as volumes for each frame, and passes them on unchanged (grid_of_points.h).
//
// Frames without points have no file, because an empty volume cannot be a source, and a sequence continues between its
// files.
#include "runtime/operators/rasterize.h"

#include <fmt/format.h>

#include <map>

#include "runtime/graph/coupling.h"
#include "runtime/operators/written_points.h"
#include "runtime/shapes/level_set/grid_of_points.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/write_grids.h"

namespace rapid {

NodeType Rasterize::declare()
{
    return node<Rasterize>("rasterize", "Writes the points as volumes to .vdb files and passes them on.")
        .varies()
        .stage(Stage::Writing)
        .param(&Rasterize::file, "file", Value(), any_number(), "",
               "pattern of the files, with #### for the frame; a file has the grid density and one grid per attribute")
        .required()
        .constant()
        .param(&Rasterize::voxel, "voxel", 0.1, at_least(min_voxel), "m", "edge of a voxel")
        .constant()
        .param(&Rasterize::radius, "radius", Value(), above(0), "m",
               "radius over which a point is spread, at least a voxel; the default is 1.5 voxels")
        .constant()
        .param(&Rasterize::weight, "weight", 1.0, at_least(0), "",
               "weight of a point; the integral of the density is the sum of the weights")
        .constant()
        .param(&Rasterize::attributes, "attributes", Value(), any_number(), "",
               "vec3 attributes, each written as a grid of its weighted mean; the default is {\"v\"}")
        .constant();
}

void Rasterize::uses(Uses& uses) const { uses.reads.insert(uses.reads.end(), attributes.begin(), attributes.end()); }

void Rasterize::check() const
{
    if (!file.ends_with(".vdb"))
        throw Error(fmt::format(
            "file = \"{}\": volumes can only be written as .vdb; give a pattern such as \"smoke.####.vdb\"", file));
    for (const std::string& name : attributes)
        if (name == "density")
            throw Error("attributes: \"density\" is already the grid of the points; choose another attribute");
}

std::string Rasterize::couples(const Plan&, const PlannedNode&) const { return "its volumes contain all points"; }

void Rasterize::edit(PointSet& points, const Evaluation& now) const
{
    if (!now.write) return;
    PointSet written = members_alone(points, group);
    if (written.empty()) return;
    std::vector<std::string> names = attributes;
    for (const PerPoint<float>* own : {radius ? &*radius : nullptr, &weight})
        if (own && !own->attribute.empty()) names.push_back(own->attribute);
    for (const std::string& name : attributes)
        if (!written.find<Vec3f>(name))
            throw Error(fmt::format(
                "attributes: \"{}\" is {}; it must be a vec3", name,
                written.has(name) ? type_name(type_of(*written.find(name))) : "not an attribute of the points"));
    keep_columns(written, names);
    now.write(file, written);
}

Flow Rasterize::start(std::span<Flow> inputs, const Evaluation& now) const
{
    edit(inputs[0].points, now);
    return std::move(inputs[0]);
}

void Rasterize::write_volumes(const std::filesystem::path& path, const PointSet& points) const
{
    const std::size_t n = points.size();
    const auto values = [&](const PerPoint<float>& parameter) {
        const Strided<float> those = parameter.read(points);
        return std::span(those.data, those.stride ? n : 1);
    };
    const auto vectors = [&](const std::string& name) {
        const Column<Vec3f>& column = *points.find<Vec3f>(name);
        std::vector<Vec3f> list(n);
        for (std::size_t i = 0; i < n; ++i) list[i] = column[i];
        return list;
    };
    const std::vector<Vec3f> P = vectors("P");
    const PerPoint<float> reach = radius.value_or(PerPoint<float>(static_cast<float>(1.5 * voxel)));
    SpreadPoints spread{P, values(reach), values(weight), {}, voxel};
    std::map<std::string, ObjectPtr> grids = {{"density", density_of_points(spread)}};
    for (const std::string& name : attributes.empty() ? std::vector<std::string>{"v"} : attributes) {
        const std::vector<Vec3f> list = vectors(name);
        spread.vectors = list;
        grids[name] = vectors_of_points(spread);
    }
    write_grids(path, grids);
}

RAPID_NODE(Rasterize);
RAPID_COUPLING("rasterize", Rasterize);

}  // namespace rapid
