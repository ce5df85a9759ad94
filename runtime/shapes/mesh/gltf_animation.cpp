#include "runtime/shapes/mesh/gltf_animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/files/input_file.h"
#include "runtime/files/skipped_contents.h"

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

GltfFile read_animated(const std::filesystem::path& path)
{
    std::string extension = without_gz(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (extension != ".gltf" && extension != ".glb") throw Error("animation is for .gltf and .glb, and it is neither");
    return read_gltf(path);
}

// Returns what `read` returns. Its errors name the file.
template <class F>
auto with_name(const std::string& name, const F& read)
{
    try {
        return read();
    } catch (const Error& error) {
        throw Error(fmt::format("cannot read the mesh \"{}\": {}", name, error.message()), error.kind());
    }
}

}  // namespace

GltfAnimatedMesh::GltfAnimatedMesh(const std::filesystem::path& path, const std::string& name, double speed,
                                   FrameSequence order)
    : name_(path.string()),
      file_(with_name(name_, [&] { return read_animated(path); })),
      animation_(with_name(name_, [&] { return &animation_of(file_, name); })),
      speed_(speed),
      order_(order)
{
    if (order.before == FrameSequence::None || order.after == FrameSequence::None)
        throw Error("before and after of an animation are \"hold\", \"repeat\" or \"mirror\"");
    for (const GltfChannel& channel : animation_->channels) {
        duration_ = std::max<double>(duration_, channel.times.back());
        if (channel.path != GltfChannel::Weights && file_.nodes[channel.node].transform.matrix)
            add_skipped(file_.skipped, fmt::format("the animation of node {}, which has a matrix; export translation, "
                                                   "rotation and scale instead",
                                                   channel.node));
    }
    vertex_of_ = join_moved_alike(file_);
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
    const MeshFile mesh = with_name(name_, [&] { return posed(file_, animation_, time); });
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
