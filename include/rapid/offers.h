// Offers of a program to its scenes: meshes, points and shapes, which scenes take as rapid.host "NAME", and nodes. This
// header is part of rapid/scene.h.
//
// Callbacks get arrays of points, never a single point. Unless stated otherwise they are called from any thread,
// several at once. Their output is checked, and exceptions that they throw become errors of the frame. Coordinates and
// vectors have shape [n][3], packed, in metres.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace rapid {

// Type of an attribute's values. UInt8 is membership of a group, String the token of a string (SceneFrame::text_of).
enum class ColumnType { Float = 0, Vec3 = 1, Int32 = 2, Int64 = 3, Quat = 4, UInt8 = 5, String = 6 };

// A triangle mesh, like that of rapid.mesh.read. If it is offered again for each frame with the same triangles, it
// moves and deforms from frame to frame (Scene::offer).
struct HostMesh {
    std::vector<std::array<float, 3>> positions;         // m
    std::vector<std::array<std::int32_t, 3>> triangles;  // counter-clockwise seen from outside; indices from 0
};

// Points, like those of rapid.points.from. They are copied.
struct HostPoints {
    // One attribute of all points.
    struct Column {
        std::string name;                        // "P" is required, of Vec3; "id" is refused: ids count from 0
        ColumnType type = ColumnType::Float;     // of the data
        const void* data = nullptr;              // shape [count][1, 3 or 4]
        std::size_t stride = 0;                  // bytes from point to point; 0: packed
        std::shared_ptr<const void> owner = {};  // of the data; may be null
    };
    std::size_t count = 0;        // of points
    std::vector<Column> columns;  // all with different names
};

// A shape given by its signed distance, for :collide, :attract, :spring and kernels.
struct HostShape {
    // Bounds, m, which may be infinite. Outside of them the distance is positive.
    std::array<double, 3> lower, upper;
    // phi, shape [n]: the distance at each position P, negative inside. gradient, shape [n][3] or null: the gradient of
    // the distance, pointing out of the shape; zero if it does not exist.
    std::function<void(std::size_t n, const double* P, double* phi, double* gradient)> distance;
    // The largest slope of the distance: 1 if it is exact. If the true slope is larger, contacts are missed.
    double slope_bound = 1;
    // m: a wall thinner than this may be missed, and a crease with a smaller radius counts as a kink; 0: the shape is
    // convex.
    double smallest_feature = 0;
};

// An object offered under a name.
using HostObject = std::variant<HostMesh, HostPoints, HostShape>;

// A parameter of a node: a number or a vector.
struct HostParameter {
    std::string name, doc;                                       // the doc is shown by `rapid nodes`
    std::variant<double, std::array<double, 3>> fallback = 0.0;  // the default
    std::string unit = {};                                       // "m/s"; empty: none
    double min = -std::numeric_limits<double>::infinity();       // of a number
    double max = std::numeric_limits<double>::infinity();        // of a number
};

// Two points that a constraint keeps at a distance.
struct HostRod {
    std::int64_t a = 0, b = 0;  // ids
    double length = 0;          // m
    double compliance = 0;      // m/N; 0: rigid
};

// The points that a node's callback processes.
struct HostCall {
    std::size_t count = 0;  // of points in this call
    double frame = 0;       // number of the frame
    double time = 0;        // s since the start; for a force, the first point's time in the middle of its substep
    double dt = 0;          // s, of a frame
    const double* parameters = nullptr;  // in the order of the declaration; a vector is three numbers

    // For a constraint: the points' ids, their positions P at the frame's beginning, and the rods of this frame,
    // initially none.
    const std::int64_t* id = nullptr;
    std::vector<HostRod>* rods = nullptr;

    // For a force: the points' positions in the middle of a substep, m, and velocities, m/s; and the accelerations to
    // add, m/s², initially zero. Shape [count][3].
    const double* P = nullptr;
    const double* v = nullptr;
    double* acceleration = nullptr;

    // Columns that the declaration reads, in its order, shape [count][1 or 3]; for an edit also those that it writes,
    // with their values.
    const float* const* reads = nullptr;
    float* const* writes = nullptr;
    std::uint8_t* kill = nullptr;  // for an edit: initially 0; points with 1 are removed afterwards. Shape [count]
};

// A node of the program. In Lua it is used like any other: `:magnet { strength = 3 }`.
struct HostNode {
    // Kinds of nodes, by the calls of their callback.
    enum Kind {
        Force,       // called for chunks of points, in each substep
        Edit,        // called once a frame, for all points of its group, on the scene's thread
        Constraint,  // returns rods between points, once a frame, for all points, on the scene's thread
    };
    std::string name, doc;                  // name: an identifier in Lua
    Kind kind = Force;                      // of the callback
    std::vector<HostParameter> parameters;  // besides `group`
    // Attributes. Known ones (age, mass, pscale, ...) have their own types; others are made with these types (Float or
    // Vec3) and zeros. An edit reads and writes P and v by these names.
    std::vector<std::pair<std::string, ColumnType>> reads, writes;
    std::function<void(const HostCall& call)> call;
};

}  // namespace rapid
