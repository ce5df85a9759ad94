#include "runtime/shapes/mesh/gltf_animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "runtime/base/error.h"

namespace rapid {
namespace {

// The spline of a frame and the jumps around it need six meshes. Two more serve the next frame.
constexpr std::size_t max_kept_poses = 8;

const GltfAnimation& animation_of(const GltfFile& file, const std::string& name)
{
    std::vector<std::string> names;
    std::string list;
    for (const GltfAnimation& animation : file.animations) {
        if (!name.empty() && animation.name == name) return animation;
        names.push_back(animation.name);
        list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", animation.name);
    }
    if (name.empty() && names.size() == 1) return file.animations[0];
    throw Error(fmt::format("there {} animation \"{}\"; the file has {}{}", name.empty() ? "is no single" : "is no",
                            name, list.empty() ? "none" : list, did_you_mean(name, names)));
}

// Corners share a vertex if they coincide at rest and in some poses: what touches at rest may part later.
std::vector<std::int32_t> join_in_all(const std::vector<std::vector<Vec3f>>& poses)
{
    std::vector<std::int32_t> joined = join_by_position(poses.front());
    for (std::size_t p = 1; p < poses.size(); ++p) {
        const std::vector<std::int32_t> further = join_by_position(poses[p]);
        std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> classes;
        for (std::size_t i = 0; i < joined.size(); ++i)
            joined[i] =
                classes.try_emplace({joined[i], further[i]}, static_cast<std::int32_t>(classes.size())).first->second;
    }
    return joined;
}

}  // namespace

GltfAnimatedMesh::GltfAnimatedMesh(const std::filesystem::path& path, const std::string& name, double speed,
                                   FrameSequence order)
    : file_(read_gltf(path)), animation_(&animation_of(file_, name)), name_(path.string()), speed_(speed), order_(order)
{
    if (order.before == FrameSequence::None || order.after == FrameSequence::None)
        throw Error("before and after of an animation are \"hold\", \"repeat\" or \"mirror\"");
    for (const GltfChannel& channel : animation_->channels)
        duration_ = std::max<double>(duration_, channel.times.back());
    std::vector<std::vector<Vec3f>> poses = {posed(file_).positions};
    constexpr int parts = 8;
    for (int k = 0; k <= parts; ++k) poses.push_back(posed(file_, animation_, duration_ * k / parts).positions);
    vertex_of_ = join_in_all(poses);
    rest_ = posed_at(0);
}

double GltfAnimatedMesh::time_at(double seconds, double fps) const
{
    const double time = (seconds - static_cast<double>(order_.offset) / fps) * speed_;
    if ((time >= 0 && time <= duration_) || duration_ == 0) return std::clamp(time, 0.0, duration_);
    switch (time < 0 ? order_.before : order_.after) {
        case FrameSequence::Repeat:
            return time - duration_ * std::floor(time / duration_);
        case FrameSequence::Mirror: {
            const double there = time - 2 * duration_ * std::floor(time / (2 * duration_));
            return std::min(there, 2 * duration_ - there);
        }
        default:
            return std::clamp(time, 0.0, duration_);
    }
}

MeshPtr GltfAnimatedMesh::posed_at(double time) const
{
    const MeshFile mesh = posed(file_, animation_, time);
    for (const Vec3f& P : mesh.positions)
        if (!P.allFinite()) throw Error(fmt::format("\"{}\" has a vertex that is not finite at {} s", name_, time));
    return joined(mesh, vertex_of_, name_);
}

MeshPtr GltfAnimatedMesh::at(const FrameClock& clock, std::int64_t frame) const
{
    const double time = time_at(clock.at(static_cast<double>(frame)).time, clock.fps);
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) { return kept.first == time; });
    MeshPtr mesh;
    if (found != kept_.end()) {
        mesh = found->second;
        kept_.erase(found);
    } else {
        mesh = posed_at(time);
    }
    kept_.emplace_front(time, mesh);
    if (kept_.size() > max_kept_poses) kept_.pop_back();
    return mesh;
}

}  // namespace rapid
