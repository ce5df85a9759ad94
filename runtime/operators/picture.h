// What a scene says of its pictures: `rapid.camera` and `:picture`. The command that draws them reads it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "runtime/graph/node.h"

namespace rapid {

// `rapid.camera`. What it leaves open is fitted to the scene, or to a group of points.
class CameraObject : public Object {
public:
    static constexpr std::string_view param_type = "camera";
    std::string_view kind() const override { return "camera"; }

    std::optional<Vec3d> position, target;  // m
    std::optional<double> fov;              // radians, vertical
    std::string group;
};

using CameraPtr = std::shared_ptr<const CameraObject>;

// A camera, or keys {[1] = a, [48] = b}: between two it goes smoothly from the one to the other.
struct CameraTrack {
    static constexpr std::string_view param_type = "camera";

    std::map<std::int64_t, CameraPtr> keys;  // by frame; of a single camera its frame is of no effect

    // Null where there is none.
    CameraPtr at(double frame) const;
};

void read_value(const Param& param, const Value& value, CameraTrack& field);

struct PictureNode {
    std::string blend, group;
    double shutter;
    bool emitters, colliders, grid;
    CameraTrack camera;

    static NodeType declare();
    void uses(Uses& uses) const;

    // The points stay as they are.
    void edit(PointSet&, const Evaluation&) const {}
};

}  // namespace rapid
