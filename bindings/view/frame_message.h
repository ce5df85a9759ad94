// Frames and shapes as binary messages for the page: positions of 16 bits a coordinate within the frame's bounds,
// colours of 8, values of 16. A message is the number of its request, the length of a header in JSON, that header, and
// the arrays that it names, each at a multiple of four bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "bindings/view/points.h"
#include "include/rapid/shapes.h"

namespace rapid {

struct FrameWish {
    std::string colour;          // an attribute, "speed", "group:NAME"; empty: Cd, else speed
    std::string group;           // whose points; empty: all
    bool velocities = false;     // for streaks
    std::size_t most = 2000000;  // points; of more, those whose id is a multiple of a power of two
};

// The places of the points that are shown; nothing where these are all. Error: no such group.
struct ShownPoints {
    std::optional<Places> places;
    std::size_t count = 0;
    std::uint64_t every = 1;  // of the ids

    std::size_t operator[](std::size_t k) const { return places ? (*places)[k] : k; }
    const Places* all_or_some() const { return places ? &*places : nullptr; }
};
ShownPoints shown_points(const SceneFrame& points, const FrameWish& wish);

// head: members of the header, as JSON in braces. Error: no such attribute or group.
std::string frame_message(std::uint32_t request, const SceneFrame& points, const FrameWish& wish,
                          const std::string& head);

// The shapes of a frame: planes, and meshes by their numbers, without those that the page has. head: as above.
std::string shapes_message(std::uint32_t request, const SceneShapes& shapes, const std::set<std::uint64_t>& known,
                           const std::vector<std::uint64_t>& numbers, const std::string& head);

// Ends of line segments, x y z and how old they are, from 0 to 1; every: as of ShownPoints.
std::string trails_message(std::uint32_t request, const std::vector<float>& ends, std::uint64_t every);

// A value of each point at `places`, null: of all: an attribute as a number (the length of a vector), "speed", or
// membership of "group:NAME". Error: no such attribute or group.
std::vector<float> numbers_of(const SceneFrame& points, const std::string& name, const Places* places = nullptr);

}  // namespace rapid
