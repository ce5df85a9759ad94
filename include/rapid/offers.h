// What a program offers to its scenes: meshes, points and shapes, which they take as rapid.host "NAME", and nodes. Part
// of rapid/scene.h.
//
// Callbacks get arrays of points, never one point. They are called from any thread, several at once, but where it says
// otherwise; what they write is checked, and what they throw is an error of the frame. Coordinates are shape [n][3],
// packed, in metres; vectors likewise.
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

// Of the values of an attribute; a UInt8 is a member of a group, a String the token of a text (SceneFrame::text_of).
enum class ColumnType { Float = 0, Vec3 = 1, Int32 = 2, Int64 = 3, Quat = 4, UInt8 = 5, String = 6 };

// A triangle mesh, as rapid.mesh.read gives it.
struct HostMesh {
    std::vector<std::array<float, 3>> positions;         // m
    std::vector<std::array<std::int32_t, 3>> triangles;  // counter-clockwise seen from outside; places from 0
};

// Points, as rapid.points.from gives them; they are copied.
struct HostPoints {
    // One attribute of all points.
    struct Column {
        std::string name;                        // "P" is required, of Vec3; an "id" is not taken: ids count from 0
        ColumnType type = ColumnType::Float;     // of the data
        const void* data = nullptr;              // shape [count][1, 3 or 4]
        std::size_t stride = 0;                  // bytes from point to point; 0: packed
        std::shared_ptr<const void> owner = {};  // of the data; may be null
    };
    std::size_t count = 0;        // of points
    std::vector<Column> columns;  // each of another name
};

// A shape by its signed distance, for :collide, :attract, :spring and kernels.
struct HostShape {
    // Its bounds, m, which may be infinite: outside of them the distance is above 0.
    std::array<double, 3> lower, upper;
    // phi, shape [n]: the distance of each place P, negative inside. gradient, shape [n][3] or null: that of the
    // distance, out of the shape; zero where there is none.
    std::function<void(std::size_t n, const double* P, double* phi, double* gradient)> distance;
    // The largest slope of the distance: 1 where it is exact. Where it is larger than said, contacts are missed.
    double slope_bound = 1;
    // m: a wall thinner than this may be missed, and a crease of a smaller radius is a kink; 0: the shape is convex.
    double smallest_feature = 0;
};

// What is offered by a name.
using HostObject = std::variant<HostMesh, HostPoints, HostShape>;

// A parameter of a node: a number or a vector.
struct HostParameter {
    std::string name, doc;                                       // the doc is shown by `rapid nodes`
    std::variant<double, std::array<double, 3>> fallback = 0.0;  // the default
    std::string unit = {};                                       // "m/s"; empty: none
    double least = -std::numeric_limits<double>::infinity();     // of a number
    double most = std::numeric_limits<double>::infinity();       // of a number
};

// Two points that a constraint keeps at a distance.
struct HostRod {
    std::int64_t a = 0, b = 0;  // ids
    double length = 0;          // m
    double compliance = 0;      // m/N; 0: rigid
};

// The points that a node's callback works on.
struct HostCall {
    std::size_t count = 0;  // of points in this call
    double frame = 0;       // number of the frame
    double time = 0;        // s since the start: of a force that of the first point, in the middle of its sub-step
    double dt = 0;          // s, of a frame
    const double* parameters = nullptr;  // in the order of the declaration; a vector is three numbers

    // Of a constraint: the points' ids, where they are (below, at the frame's beginning), and the rods of this frame,
    // none at first.
    const std::int64_t* id = nullptr;
    std::vector<HostRod>* rods = nullptr;

    // Of a force: where the points are in the middle of a sub-step, m, and their velocities, m/s; and the accelerations
    // that it adds, m/s², zero at first. Shape [count][3].
    const double* P = nullptr;
    const double* v = nullptr;
    double* acceleration = nullptr;

    // The columns that the declaration reads, in its order, shape [count][1 or 3]; and of an edit those that it writes,
    // with their values.
    const float* const* reads = nullptr;
    float* const* writes = nullptr;
    std::uint8_t* kill = nullptr;  // of an edit: 0 at first; points with 1 are taken away behind it. Shape [count]
};

// A node of the program's, as good in Lua as any other: `:magnet { strength = 3 }`.
struct HostNode {
    // When it is called, and what it may do.
    enum Kind {
        Force,       // called for chunks of points, in each sub-step
        Edit,        // called once a frame, for all points of its group, on the scene's thread
        Constraint,  // gives rods between points, once a frame, for all points, on the scene's thread
    };
    std::string name, doc;                  // name: of an identifier in Lua
    Kind kind = Force;                      // of the callback
    std::vector<HostParameter> parameters;  // besides `group`
    // Attributes: of known ones (age, mass, pscale, ...) the type is known, others are made with these types (Float or
    // Vec3) and zeros. An edit reads and writes P and v by these names.
    std::vector<std::pair<std::string, ColumnType>> reads, writes;
    std::function<void(const HostCall& call)> call;
};

}  // namespace rapid
