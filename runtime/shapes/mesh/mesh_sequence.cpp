#include "runtime/shapes/mesh/mesh_sequence.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/error.h"
#include "runtime/shapes/mesh/mesh_file.h"

namespace rapid {
namespace {

// The spline of a frame and the jumps around it need six meshes. Two more serve the next frame.
constexpr std::size_t max_recent_meshes = 8;

// The spline to the last frame, and the search for a jump to the frame before, need four meshes.
constexpr std::size_t max_meshes_in_memory = 4;

// Corners of one vertex may differ by this fraction of the mesh's size, because of an exporter's rounding.
constexpr double same_corner = 1e-6;

}  // namespace

MeshSequence::MeshSequence(std::map<int, std::filesystem::path> files, std::string name, FrameSequence order)
    : files_(std::move(files)), name_(std::move(name)), order_(order)
{
    if (files_.empty()) throw Error(fmt::format("there is no mesh file \"{}\" at any frame", name_));
    order_.first = files_.begin()->first;
    order_.last = files_.rbegin()->first;
    for (int frame = first(); frame < last(); ++frame)
        if (!files_.count(frame))
            throw Error(fmt::format("frame {} of \"{}\" is missing; each frame from {} to {} needs a file", frame,
                                    name_, first(), last()));
    const MeshFile file = read_mesh_file(files_.begin()->second);
    corners_ = file.positions.size();
    faces_ = file.triangles.size();
    vertex_of_ = join_by_position(file.positions);
    rest_ = joined(file, vertex_of_, files_.begin()->second.string());
    recent_.emplace_front(first(), rest_);
}

MeshSequence::MeshSequence(MeshPtr rest, std::map<int, MeshPtr> meshes)
    : meshes_(std::move(meshes)), name_(rest->name), rest_(std::move(rest))
{
    order_.first = meshes_.begin()->first;
    order_.last = meshes_.rbegin()->first;
}

void MeshSequence::append(int frame, MeshPtr mesh)
{
    if (frame != last() + 1) meshes_ = {{frame - 1, meshes_.rbegin()->second}};
    meshes_[frame] = std::move(mesh);
    if (meshes_.size() > max_meshes_in_memory) meshes_.erase(meshes_.begin());
    order_.first = meshes_.begin()->first;
    order_.last = frame;
}

MeshPtr MeshSequence::at(std::int64_t frame) const
{
    const std::int64_t nearest = std::clamp<std::int64_t>(frame - order_.offset, first(), last());
    const int held = static_cast<int>(order_.file_of(frame).value_or(nearest));
    if (!meshes_.empty()) return meshes_.at(held);
    const std::lock_guard lock(mutex_);
    const auto found =
        std::find_if(recent_.begin(), recent_.end(), [&](const auto& kept) { return kept.first == held; });
    MeshPtr mesh;
    if (found != recent_.end()) {
        mesh = found->second;
        recent_.erase(found);
    } else {
        mesh = read(held);
    }
    recent_.emplace_front(held, mesh);
    if (recent_.size() > max_recent_meshes) recent_.pop_back();
    return mesh;
}

MeshPtr MeshSequence::read(int frame) const
{
    const std::filesystem::path& path = files_.at(frame);
    const MeshFile file = read_mesh_file(path);
    const auto counts = [](std::size_t corners, std::size_t faces) {
        return fmt::format("{} corners and {} faces", corners, faces);
    };
    if (file.positions.size() != corners_ || file.triangles.size() != faces_)
        throw Error(fmt::format(
            "\"{}\" changes at frame {}: it has {} there and {} at frame {}; a sequence must keep the vertices and "
            "faces of its mesh",
            name_, frame, counts(file.positions.size(), file.triangles.size()), counts(corners_, faces_), first()));
    MeshPtr mesh = joined(file, vertex_of_, path.string());
    const auto other =
        std::mismatch(mesh->triangles.begin(), mesh->triangles.end(), rest_->triangles.begin(), rest_->triangles.end());
    if (other.first != mesh->triangles.end())
        throw Error(
            fmt::format("\"{}\" changes at frame {}: it has as many faces as at frame {} ({}), but face {} joins other "
                        "vertices; a sequence must keep the faces of its mesh",
                        name_, frame, first(), faces_, other.first - mesh->triangles.begin()));

    const double near = same_corner * mesh->bounds().sizes().maxCoeff();
    for (std::size_t corner = 0; corner < corners_; ++corner) {
        const double apart = (file.positions[corner] - mesh->positions[vertex_of_[corner]]).norm();
        if (!(apart <= near))
            throw Error(
                fmt::format("corner {} of \"{}\" shares a vertex at frame {} and is {:.3g} m away from it at frame {}; "
                            "begin the sequence at a frame in which separate parts do not touch",
                            corner, name_, first(), apart, frame));
    }
    return mesh;
}

}  // namespace rapid
