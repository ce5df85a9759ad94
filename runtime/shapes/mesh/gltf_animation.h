// The meshes of a glTF file, moved by one of its animations: nodes, skins and morph targets.
#pragma once

#include <deque>
#include <limits>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/frame_sequence.h"
#include "runtime/shapes/mesh/deforming_mesh.h"
#include "runtime/shapes/mesh/gltf_file.h"

namespace rapid {

class GltfAnimatedMesh final : public DeformingMesh {
public:
    // name: of the animation; empty for the only one. order: what happens before the first and after the last key, and
    // the frames by which the animation is delayed; by default it begins at time 0. speed: seconds of the animation per
    // second. Throws Error, which names the file, if its extension is not .gltf or .glb, if there is no such animation,
    // or if read_gltf() does.
    GltfAnimatedMesh(const std::filesystem::path& path, const std::string& name, double speed, FrameSequence order);

    const MeshPtr& rest() const override { return rest_; }
    double begins() const override { return -std::numeric_limits<double>::infinity(); }
    double ends() const override { return std::numeric_limits<double>::infinity(); }
    bool depends_on_clock() const override { return true; }
    bool has(std::int64_t) const override { return true; }
    MeshPtr at(const FrameClock& clock, std::int64_t frame) const override;

    // Returns the time of the animation, s, at a time of the scene.
    double time_at(double seconds, double fps) const;

private:
    MeshPtr posed_at(double time) const;

    std::string name_;  // of the file
    GltfFile file_;
    const GltfAnimation* animation_;
    double speed_, duration_ = 0;
    FrameSequence order_;
    std::vector<std::int32_t> vertex_of_;  // maps corners to vertices
    MeshPtr rest_;

    mutable std::mutex mutex_;
    mutable std::deque<std::pair<double, MeshPtr>> kept_;  // by time; most recent first
};

}  // namespace rapid
