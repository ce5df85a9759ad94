// rapid.levelset: narrow-band level sets.
#include "runtime/shapes/level_set/level_set.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <tuple>

#include "bindings/host/makers/grid_files.h"
#include "bindings/host/makers/written_vdb.h"
#include "runtime/graph/points_object.h"
#include "runtime/shapes/level_set/level_set_tools.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/motion/level_set_sequence.h"

namespace rapid {
namespace {

// Parameters of every level set.
struct Grid {
    double voxel, half_width;

    LevelSetOptions options() const { return {voxel, half_width}; }

    template <class T>
    static void declare(MakerDeclaration<T>& declaration)
    {
        declaration
            .param(static_cast<double T::*>(&T::voxel), "voxel", 0.1, at_least(min_voxel), "m", "edge of a voxel")
            .param(static_cast<double T::*>(&T::half_width), "half_width", 3.0, at_least(1.5), "voxels",
                   "width of the band on each side of the surface");
    }
};

// A mesh, at rest, moving or deforming.
struct AnyMesh {
    static constexpr std::string_view param_type = "mesh";

    MeshPtr still;
    std::shared_ptr<const AnimatedMesh> moving;
};

void read_value(const Param& param, const Value& value, AnyMesh& mesh)
{
    mesh = {};
    if (!(mesh.moving = value.object<AnimatedMesh>())) rapid::read_value(param, value, mesh.still);
}

// A level set in use that was made from a mesh with these options.
struct MadeFromMesh {
    std::weak_ptr<const Object> mesh, result;
};
using Made = std::map<std::tuple<const Object*, double, double>, MadeFromMesh>;

struct FromMesh : Grid {
    AnyMesh mesh;

    static Maker declare()
    {
        auto declaration = maker<FromMesh>(
            "levelset.from_mesh",
            "Returns the level set of a closed mesh; a mesh that moves or deforms gives a shape that does.");
        declaration.param(&FromMesh::mesh, "mesh", Value(), any_number(), "", "closed mesh").required();
        Grid::declare(declaration);
        return declaration;
    }
    ObjectPtr make(MakeContext& context) const
    {
        if (mesh.moving) return moving_shape(mesh.moving, context);
        const auto state = std::dynamic_pointer_cast<const MeshOfFrame>(mesh.still);
        const auto moving = in_motion<AnimatedMesh>(state);
        const auto body =
            moving ? std::dynamic_pointer_cast<const DeformingLevelSet>(moving_shape(moving, context)) : nullptr;
        return made_once(mesh.still, [&]() -> ObjectPtr {
            return body ? body->of(*state) : level_set_from_mesh(mesh.still, options(), context.warnings);
        });
    }

private:
    ObjectPtr moving_shape(const std::shared_ptr<const AnimatedMesh>& moving, MakeContext& context) const
    {
        return made_once(moving, [&]() -> ObjectPtr {
            if (moving->deforms()) return std::make_shared<DeformingLevelSet>(moving, options(), context.warnings);
            return std::make_shared<AnimatedShape>(level_set_from_mesh(moving->rest(), options(), context.warnings),
                                                   moving->motion());
        });
    }

    // Returns one result for the same mesh and options, however often it is requested.
    template <class F>
    ObjectPtr made_once(const ObjectPtr& from, const F& build) const
    {
        static std::mutex mutex;
        static Made made;
        const std::lock_guard lock(mutex);
        std::erase_if(made, [](const auto& entry) { return entry.second.result.expired(); });
        MadeFromMesh& known = made[{from.get(), voxel, half_width}];
        ObjectPtr result = known.result.lock();
        if (!result || known.mesh.lock() != from) known = {from, result = build()};
        return result;
    }
};
RAPID_MAKER(FromMesh);

struct SphereLevelSet : Grid {
    double radius;
    Vec3d center;

    static Maker declare()
    {
        auto declaration = maker<SphereLevelSet>("levelset.sphere", "Returns a level set of a sphere.");
        declaration.param(&SphereLevelSet::radius, "radius", 1.0, above(0), "m", "radius of the sphere")
            .param(&SphereLevelSet::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre");
        Grid::declare(declaration);
        return declaration;
    }
    ObjectPtr make(MakeContext&) const { return level_set_sphere(radius, center, options()); }
};
RAPID_MAKER(SphereLevelSet);

struct BoxLevelSet : Grid {
    Vec3d size, center;

    static Maker declare()
    {
        auto declaration = maker<BoxLevelSet>("levelset.box", "Returns a level set of a box.");
        declaration.param(&BoxLevelSet::size, "size", Vec3d(1, 1, 1), any_number(), "m", "full edge lengths")
            .param(&BoxLevelSet::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre");
        Grid::declare(declaration);
        return declaration;
    }
    ObjectPtr make(MakeContext&) const
    {
        if (!(size.minCoeff() > 0))
            throw Error(fmt::format("size = {}: each edge must be above 0", describe(Value(size))));
        return level_set_box(size, center, options());
    }
};
RAPID_MAKER(BoxLevelSet);

struct TorusLevelSet : Grid {
    double radius, tube;
    Vec3d center;

    static Maker declare()
    {
        auto declaration = maker<TorusLevelSet>("levelset.torus", "Returns a level set of a torus about the y axis.");
        declaration
            .param(&TorusLevelSet::radius, "radius", 1.0, above(0), "m",
                   "distance from the axis to the centre of the tube")
            .param(&TorusLevelSet::tube, "tube", 0.25, above(0), "m", "radius of the tube")
            .param(&TorusLevelSet::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre");
        Grid::declare(declaration);
        return declaration;
    }
    ObjectPtr make(MakeContext&) const { return level_set_torus(radius, tube, center, options()); }
};
RAPID_MAKER(TorusLevelSet);

struct FromPoints : Grid {
    std::shared_ptr<const PointsObject> points;
    std::optional<PerPoint<float>> radius;

    static Maker declare()
    {
        auto declaration =
            maker<FromPoints>("levelset.from_points", "Returns the level set of the union of spheres around points.");
        declaration.param(&FromPoints::points, "points", Value(), any_number(), "", "centres of the spheres")
            .required();
        declaration.param(&FromPoints::radius, "radius", Value(), above(0), "m",
                          "radius of the spheres; the default is the attribute pscale");
        Grid::declare(declaration);
        return declaration;
    }
    ObjectPtr make(MakeContext&) const
    {
        const PointSet& set = points->points;
        if (!radius && !set.has("pscale"))
            throw Error("the radius of the spheres is unknown; give radius, or give the points the attribute pscale");
        const PerPoint<float> given = radius ? *radius : PerPoint<float>::of("pscale");
        const Strided<Vec3f> P = set.P().read();
        const Strided<float> r = given.read(set);
        const std::size_t n = set.size();
        std::vector<Vec3f> positions;
        for (std::size_t i = 0; i < n; ++i) positions.push_back(P[i]);
        return level_set_from_points(positions, std::span(r.data, r.stride ? n : 1), options());
    }
};
RAPID_MAKER(FromPoints);

struct CombineLevelSets {
    LevelSetPtr levelset, other;
    std::string how;

    static Maker declare()
    {
        return maker<CombineLevelSets>("levelset.combine",
                                       "Returns the union, intersection or difference of two level sets.")
            .param(&CombineLevelSets::levelset, "levelset", Value(), any_number(), "",
                   "level set whose voxels the result has")
            .required()
            .param(&CombineLevelSets::other, "other", Value(), any_number(), "", "second level set")
            .required()
            .param(&CombineLevelSets::how, "how", Value(), any_number(), "", "operation")
            .required();
    }
    ObjectPtr make(MakeContext& context) const
    {
        return combine_level_sets(levelset, other,
                                  how == "union"       ? Combine::Union
                                  : how == "intersect" ? Combine::Intersect
                                                       : Combine::Subtract,
                                  context.warnings);
    }
};
RAPID_MAKER(CombineLevelSets);

struct OffsetLevelSet {
    LevelSetPtr levelset;
    double metres;

    static Maker declare()
    {
        return maker<OffsetLevelSet>("levelset.offset", "Moves the surface along its normal.")
            .param(&OffsetLevelSet::levelset, "levelset", Value(), any_number(), "", "level set to grow")
            .required()
            .param(&OffsetLevelSet::metres, "metres", Value(), any_number(), "m",
                   "distance outwards; a negative value moves the surface inwards")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return offset_level_set(levelset, metres); }
};
RAPID_MAKER(OffsetLevelSet);

struct SmoothLevelSet {
    LevelSetPtr levelset;
    int width, iterations;

    static Maker declare()
    {
        return maker<SmoothLevelSet>("levelset.smooth", "Rounds edges and fills creases.")
            .param(&SmoothLevelSet::levelset, "levelset", Value(), any_number(), "", "level set to smooth")
            .required()
            .param(&SmoothLevelSet::width, "width", 1.0, between(1, 64), "voxels", "width of the filter")
            .param(&SmoothLevelSet::iterations, "iterations", 1.0, between(1, 1000), "",
                   "number of times that the filter is applied");
    }
    ObjectPtr make(MakeContext&) const { return smooth_level_set(levelset, width, iterations); }
};
RAPID_MAKER(SmoothLevelSet);

struct ResampleLevelSet {
    LevelSetPtr levelset;
    double voxel;

    static Maker declare()
    {
        return maker<ResampleLevelSet>("levelset.resample", "Returns the same surface with voxels of another size.")
            .param(&ResampleLevelSet::levelset, "levelset", Value(), any_number(), "", "level set to resample")
            .required()
            .param(&ResampleLevelSet::voxel, "voxel", Value(), at_least(min_voxel), "m", "edge of a voxel")
            .required();
    }
    ObjectPtr make(MakeContext&) const { return resample_level_set(levelset, voxel); }
};
RAPID_MAKER(ResampleLevelSet);

struct ReadLevelSet : GridFiles {
    static Maker declare()
    {
        auto declaration =
            maker<ReadLevelSet>("levelset.read", "Reads a level set from a .vdb file, or a sequence of them.");
        return GridFiles::declare(declaration, "name of the grid; the default is the only level set in the file");
    }
    ObjectPtr make(MakeContext& context) const
    {
        check(path, is_sequence(context));
        if (!is_sequence(context)) return read_one(context, read_level_set);
        const SequenceFiles sequence = files(context);
        const auto read = [name = grid](const std::filesystem::path& file) { return read_level_set(file, name); };
        const std::int64_t first = sequence.files.begin()->first + sequence.order.offset;
        auto made = std::make_shared<LevelSetSequence>(sequence, path, read);
        made->at(first);
        return made;
    }
};
RAPID_MAKER(ReadLevelSet);

// The call of a sequence with a frame.
struct LevelSetOfFrame {
    std::shared_ptr<const LevelSetSequence> levelset;
    double frame;

    static Maker declare()
    {
        return maker<LevelSetOfFrame>("levelset.at", "Returns the level set of one frame of a sequence.")
            .param(&LevelSetOfFrame::levelset, "levelset", Value(), any_number(), "", "sequence")
            .required()
            .param(&LevelSetOfFrame::frame, "frame", Value(), any_number(), "", "number of the frame")
            .required();
    }
    // Returns null at a frame without a level set: a function of the frame then returns nil.
    ObjectPtr make(MakeContext&) const { return levelset->at(static_cast<std::int64_t>(std::ceil(frame))); }
};
RAPID_MAKER(LevelSetOfFrame);

struct WriteLevelSet {
    LevelSetPtr levelset;
    std::string path, grid;

    static Maker declare()
    {
        return maker<WriteLevelSet>("levelset.write", "Writes a level set to a .vdb file, in a run.")
            .param(&WriteLevelSet::levelset, "levelset", Value(), any_number(), "", "level set to write")
            .required()
            .param(&WriteLevelSet::path, "path", Value(), any_number(), "", "path, relative to the current folder")
            .required()
            .param(&WriteLevelSet::grid, "grid", std::string("surface"), any_number(), "", "name in the file");
    }
    ObjectPtr make(MakeContext& context) const
    {
        require_vdb(path);
        if (context.may_write) levelset->write(path, grid);
        return levelset;
    }
};
RAPID_MAKER(WriteLevelSet);

}  // namespace
}  // namespace rapid
