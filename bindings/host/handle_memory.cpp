#include "bindings/host/handle_memory.h"

#include <malloc.h>

#include <algorithm>
#include <lua.hpp>

#include "runtime/base/memory_budget.h"
#include "runtime/graph/node_type.h"
#include "runtime/graph/points_object.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/placed.h"
#include "runtime/shapes/level_set/vector_grid.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/shape.h"

namespace rapid {
namespace {

constexpr char counts_field[] = "rapid.handle_memory";  // in the registry

constexpr std::size_t min_held = std::size_t{16} << 20;  // bytes below which a collection is not worthwhile

constexpr std::size_t piece = std::size_t{64} << 20;  // bytes per request

struct Counts {
    std::size_t held = 0, most = min_held;
    std::size_t left = piece;  // bytes left of the last request; the first piece is not requested
};

Counts& counts_of(lua_State* L)
{
    lua_getfield(L, LUA_REGISTRYINDEX, counts_field);
    Counts& counts = *static_cast<Counts*>(lua_touserdata(L, -1));
    lua_pop(L, 1);
    return counts;
}

// OpenVDB's nodes above the leaves: each of the two upper kinds has a pointer for every possible child, 32^3 and 16^3
// of them, and an object at the origin spans eight nodes of each kind.
constexpr std::size_t bytes_of_upper_nodes = 8 * (32 * 32 * 32 + 16 * 16 * 16) * sizeof(void*);

// Returns the approximate bytes of an object's arrays.
std::size_t weight_of(const Object& object)
{
    constexpr std::size_t bytes_of_node = 1024;  // of a graph node
    if (dynamic_cast<const NodeHandle*>(&object)) return bytes_of_node;
    // A level set is two grids of floats: one for queries, whose blocks are about half full, and OpenVDB's, which some
    // get later but all are charged for.
    constexpr std::size_t bytes_per_voxel = 2 * 2 * sizeof(float);
    constexpr std::size_t bytes_of_leaves = std::size_t{2} << 20;  // for grids that do not report their size
    if (dynamic_cast<const PlacedLevelSet*>(&object)) return 0;    // the level set's owner is charged
    if (const auto* level_set = dynamic_cast<const LevelSet*>(&object))
        return bytes_of_upper_nodes + static_cast<std::size_t>(level_set->active_voxels()) * bytes_per_voxel;
    if (const auto* mesh = dynamic_cast<const Mesh*>(&object))
        return mesh->positions.size() * sizeof(Vec3f) + mesh->triangles.size() * sizeof(Mesh::Triangle);
    if (const auto* points = dynamic_cast<const PointsObject*>(&object)) return points->points.bytes();
    if (dynamic_cast<const VectorGrid*>(&object) || dynamic_cast<const DensityGrid*>(&object))
        return bytes_of_upper_nodes + bytes_of_leaves;
    // A shape offered by an embedding program uses that program's memory, whose size is unknown.
    constexpr std::size_t bytes_of_shape = std::size_t{64} << 10;
    return dynamic_cast<const Shape*>(&object) ? bytes_of_shape : 0;
}

}  // namespace

void count_handles(lua_State* L)
{
    new (lua_newuserdata(L, sizeof(Counts))) Counts;
    lua_setfield(L, LUA_REGISTRYINDEX, counts_field);
}

void hold(lua_State* L, const Object& object)
{
    const std::size_t bytes = weight_of(object);
    if (bytes == 0) return;
    Counts& counts = counts_of(L);
    counts.held += bytes;
    const bool asks = counts.left < bytes, full = asks && !fits_in_memory(piece);
    counts.left = asks ? piece : counts.left - bytes;
    if (!full && counts.held <= counts.most) return;
    lua_gc(L, LUA_GCCOLLECT, 0);
    counts.most = std::max(min_held, 2 * counts.held);
    if (!full) return;
    malloc_trim(0);  // memory released by the collector
    if (!fits_in_memory(piece))
        throw memory_exceeded("a further 64 MiB of nodes, level sets, meshes and points", piece, "make fewer of them");
}

void release(lua_State* L, const Object& object)
{
    if (const std::size_t bytes = weight_of(object)) counts_of(L).held -= bytes;
}

}  // namespace rapid
