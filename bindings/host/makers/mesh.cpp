// rapid.mesh: meshes that are read or generated.
#include "runtime/shapes/mesh/mesh.h"

#include <fmt/format.h>

#include "bindings/host/makers/file_axes.h"
#include "bindings/host/makers/sequence_options.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/shapes/mesh/detailed_mesh.h"
#include "runtime/shapes/mesh/gltf_animation.h"
#include "runtime/shapes/mesh/mesh_sequence.h"
#include "runtime/shapes/motion/animated.h"

namespace rapid {
namespace {

struct ReadMesh : SequenceOptions, FileAxes {
    std::string path;
    std::optional<std::string> animation;
    std::optional<double> speed;

    static Maker declare()
    {
        auto declaration =
            maker<ReadMesh>("mesh.read", "Reads a mesh from OBJ, PLY, STL or glTF, or from a sequence of such files.");
        declaration
            .param(&ReadMesh::path, "path", Value(), any_number(), "",
                   "path, relative to the graph file; with #### or $F4 a file for each frame, for a mesh that deforms")
            .required();
        declaration
            .param(
                &ReadMesh::animation, "animation", Value(), any_number(), "",
                "the name of an animation of a glTF file, which moves and deforms the mesh from time 0 on; \"\" is the "
                "only one")
            .param(&ReadMesh::speed, "speed", Value(), any_number(), "", "seconds of the animation per second");
        FileAxes::declare(declaration);
        return SequenceOptions::declare(declaration);
    }
    ObjectPtr make(MakeContext& context) const
    {
        if (animation) return animated(context);
        if (speed) throw Error("speed is for an animation; give its name as animation");
        const auto pattern = FramePattern::of_files(context.folder / path);  // an absolute path stays itself
        check(path, pattern.has_frame());
        if (!pattern.has_frame()) {
            const MeshPtr mesh = read_mesh(context.resolve(path));
            warn_of_skipped(*mesh, context);
            return are_ours() ? mesh : transformed(mesh, pose().affine());
        }
        const auto files = pattern.existing();
        if (context.on_read)
            for (const auto& [frame, file] : files) context.on_read(file);
        auto sequence = std::make_shared<MeshSequence>(files, pattern.text(), order());
        warn_of_skipped(*sequence->rest(), context);
        return std::make_shared<AnimatedMesh>(std::move(sequence), constant_motion(pose()));
    }

private:
    ObjectPtr animated(MakeContext& context) const
    {
        const std::filesystem::path file = context.resolve(path);
        if (std::error_code none; !std::filesystem::exists(file, none))
            throw Error(fmt::format("there is no mesh file \"{}\"", file.string()));
        auto mesh = std::make_shared<GltfAnimatedMesh>(file, *animation, speed.value_or(1), order());
        warn_of_skipped(*mesh->rest(), context);
        return std::make_shared<AnimatedMesh>(std::move(mesh), constant_motion(pose()));
    }

    static void warn_of_skipped(const Mesh& mesh, MakeContext& context)
    {
        const auto* detailed = dynamic_cast<const DetailedMesh*>(&mesh);
        if (!detailed) return;
        for (const std::string& what : detailed->skipped)
            context.warnings.push_back(fmt::format("rapid.mesh.read: \"{}\": {}", mesh.name, what));
    }
};
RAPID_MAKER(ReadMesh);

struct SphereMesh {
    double radius;
    int divisions;
    Vec3d center;

    static Maker declare()
    {
        return maker<SphereMesh>("mesh.sphere", "Returns a mesh of a sphere.")
            .param(&SphereMesh::radius, "radius", 1.0, above(0), "m", "radius of the sphere")
            .param(&SphereMesh::divisions, "divisions", 24.0, between(3, 4096), "",
                   "number of divisions around the equator")
            .param(&SphereMesh::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre");
    }
    ObjectPtr make(MakeContext&) const { return make_sphere(radius, divisions, center); }
};
RAPID_MAKER(SphereMesh);

void check_size(const Vec3d& size)
{
    if (!(size.minCoeff() > 0)) throw Error(fmt::format("size = {}: each edge must be above 0", describe(Value(size))));
}

struct BoxMesh {
    Vec3d size, center;

    static Maker declare()
    {
        return maker<BoxMesh>("mesh.box", "Returns a mesh of a box.")
            .param(&BoxMesh::size, "size", Vec3d(1, 1, 1), any_number(), "m", "full edge lengths")
            .param(&BoxMesh::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre");
    }
    ObjectPtr make(MakeContext&) const
    {
        check_size(size);
        return make_box(size, center);
    }
};
RAPID_MAKER(BoxMesh);

struct GridMesh {
    std::vector<double> size;
    int divisions;
    Vec3d center;

    static Maker declare()
    {
        return maker<GridMesh>("mesh.grid", "Returns a flat grid that faces up.")
            .param(&GridMesh::size, "size", Value(), any_number(), "m", "edge lengths {x, z}; the default is {1, 1}")
            .param(&GridMesh::divisions, "divisions", 10.0, between(1, 4096), "", "number of cells along each edge")
            .param(&GridMesh::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre");
    }
    ObjectPtr make(MakeContext&) const
    {
        const double x = size.empty() ? 1 : size[0], z = size.empty() ? 1 : size.back();
        if (size.size() > 2 || !(x > 0) || !(z > 0)) throw Error("size must be two lengths above 0, {x, z}");
        return make_grid(x, z, divisions, center);
    }
};
RAPID_MAKER(GridMesh);

struct TorusMesh {
    double radius, tube;
    int divisions;
    Vec3d center;

    static Maker declare()
    {
        return maker<TorusMesh>("mesh.torus", "Returns a mesh of a torus about the y axis.")
            .param(&TorusMesh::radius, "radius", 1.0, above(0), "m", "distance from the axis to the centre of the tube")
            .param(&TorusMesh::tube, "tube", 0.25, above(0), "m", "radius of the tube")
            .param(&TorusMesh::divisions, "divisions", 24.0, between(3, 4096), "",
                   "number of divisions around the axis; those around the tube get edges of the same length")
            .param(&TorusMesh::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre");
    }
    ObjectPtr make(MakeContext&) const { return make_torus(radius, tube, divisions, center); }
};
RAPID_MAKER(TorusMesh);

// Returns values at vertices by name: numbers, or vec3 if the first is one.
std::map<std::string, Mesh::VertexValues> vertex_values(const std::map<std::string, Value>& lists, std::size_t vertices)
{
    std::map<std::string, Mesh::VertexValues> values;
    for (const auto& named : lists) {
        const auto& name = named.first;
        const auto& list = named.second;
        if (name == "P" || name == "v" || name == "id")
            throw Error(fmt::format(
                "values: {} can't be given, because the birth of a point sets it; choose another name", name));
        const Table* table = list.table();
        if (!table || table->list.size() != vertices)
            throw Error(fmt::format("values: {} has {}; it must be a list of {} values, one for each of `points`", name,
                                    table ? fmt::format("{} values", table->list.size()) : describe(list), vertices));
        Param param;
        param.name = name;
        const auto read = [&]<class T>(std::vector<T> column) {
            param.type = std::is_same_v<T, float> ? "list of numbers" : "list of {x, y, z}";
            read_value(param, list, column);
            values[name] = std::move(column);
        };
        if (vertices > 0 && table->list.front().get<double>())
            read(std::vector<float>());
        else
            read(std::vector<Vec3f>());
    }
    return values;
}

struct MeshFrom {
    std::vector<Vec3f> points;
    std::vector<std::vector<double>> faces;
    std::map<std::string, Value> values;

    static Maker declare()
    {
        return maker<MeshFrom>("mesh.from", "Returns a mesh from a list of positions and a list of faces.")
            .param(&MeshFrom::points, "points", Value(), any_number(), "m", "positions {{x, y, z}, ...}")
            .required()
            .param(&MeshFrom::faces, "faces", Value(), any_number(), "",
                   "faces {{1, 2, 3}, ...} of indices in points, from 1")
            .required()
            .param(&MeshFrom::values, "values", Value(), any_number(), "",
                   "values at each of points, { Cd = {{r, g, b}, ...}, heat = {...} }, for points that are born on the "
                   "mesh");
    }
    ObjectPtr make(MakeContext&) const
    {
        std::vector<std::vector<std::int32_t>> indices;
        for (std::size_t f = 0; f < faces.size(); ++f) {
            std::vector<std::int32_t>& face = indices.emplace_back();
            for (const double corner : faces[f]) {
                if (!(corner >= 1 && corner <= static_cast<double>(points.size())) || corner != std::floor(corner))
                    throw Error(fmt::format("face {} has the corner {}; a corner must be a whole number from 1 to {}",
                                            f + 1, corner, points.size()));
                face.push_back(static_cast<std::int32_t>(corner) - 1);
            }
        }
        auto mesh = std::make_shared<Mesh>(*make_mesh(points, indices));
        mesh->values = vertex_values(values, points.size());
        return mesh;
    }
};
RAPID_MAKER(MeshFrom);

}  // namespace
}  // namespace rapid
