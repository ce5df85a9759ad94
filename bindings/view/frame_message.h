// Encodes frames and shapes as binary messages for the page: positions with 16 bits per coordinate within the frame's
// bounds, colours with 8, values with 16. A message is the number of its request, the length of a header in JSON, that
// header, and the arrays that it names, each aligned to four bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "bindings/view/points.h"
#include "include/rapid/shapes.h"
#include "runtime/base/json.h"

namespace rapid {

struct FrameOptions {
    std::string colour;          // an attribute, "speed", "group:NAME"; empty: Cd, else speed
    std::string group;           // shows its points; empty: all
    bool velocities = false;     // for streaks
    std::size_t most = 2000000;  // points; if there are more, those whose id is a multiple of a power of two
};

// Indices of the points that are shown, or nothing if all are. Throws Error if the group does not exist.
struct ShownPoints {
    std::optional<Indices> indices;
    std::size_t count = 0;
    std::uint64_t every = 1;  // ids are multiples of it

    std::size_t operator[](std::size_t k) const { return indices ? (*indices)[k] : k; }
    const Indices* all_or_some() const { return indices ? &*indices : nullptr; }
};
ShownPoints shown_points(const SceneFrame& points, const FrameOptions& frame_options);

// head: members of the header, an object. Throws Error if the attribute or group does not exist.
std::string frame_message(std::uint32_t request, const SceneFrame& points, const FrameOptions& frame_options,
                          CheckedJson head);

// Returns the shapes of a frame: planes, and meshes by number, without those that the page has. head: as above.
std::string shapes_message(std::uint32_t request, const SceneShapes& shapes, const std::set<std::uint64_t>& known,
                           const std::vector<std::uint64_t>& numbers, CheckedJson head);

// ends: ends of line segments, with x y z and their age from 0 to 1; every: as in ShownPoints.
std::string trails_message(std::uint32_t request, const std::vector<float>& ends, std::uint64_t every);

// Returns a value for each point at `indices` (null: all points): an attribute as a number (the length of a vector),
// "speed", or membership of "group:NAME". Throws Error if the attribute or group does not exist.
std::vector<float> numbers_of(const SceneFrame& points, const std::string& name, const Indices* indices = nullptr);

}  // namespace rapid
