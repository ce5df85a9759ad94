// The picture settings of a scene: `rapid.camera` and `:picture`. The command that draws pictures reads them.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "runtime/graph/node.h"

namespace rapid {

// The object of `rapid.camera`. Unset values are fitted to the scene, or to a group of points.
class CameraObject : public Object {
public:
    static constexpr std::string_view param_type = "camera";
    std::string_view kind() const override { return "camera"; }

    std::optional<Vec3d> position, target;  // m
    std::optional<double> fov;              // radians, vertical
    std::string group;
};

using CameraPtr = std::shared_ptr<const CameraObject>;

// A camera, or keys {[1] = a, [48] = b}, with a smooth transition between two keys.
struct CameraTrack {
    static constexpr std::string_view param_type = "camera";

    std::map<std::int64_t, CameraPtr> keys;  // by frame; the frame of a single camera has no effect

    // Returns null if there is no camera.
    CameraPtr at(double frame) const;
};

void read_value(const Param& param, const Value& value, CameraTrack& field);

struct PictureNode {
    std::string blend, draw, group;
    double shutter;
    bool emitters, colliders, grid;
    CameraTrack camera;

    static NodeType declare();
    void uses(Uses& uses) const;

    // Leaves the points unchanged.
    void edit(PointSet&, const Evaluation&) const {}
};

}  // namespace rapid
