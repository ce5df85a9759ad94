#include "bindings/scene/offered_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace rapid {
namespace {

bool same_faces(const Mesh& a, const Mesh& b)
{
    return a.positions.size() == b.positions.size() && a.triangles == b.triangles;
}

std::string describe_change(const std::string& name, std::int64_t frame, const Mesh& before, const Mesh& mesh)
{
    const auto counts = [](const Mesh& one) {
        return fmt::format("{} vertices and {} faces", one.positions.size(), one.triangles.size());
    };
    const std::string was = counts(before), is = counts(mesh);
    return fmt::format(
        "the program offers \"{}\": at frame {} it has other faces than before ({}); in such a frame the mesh does not "
        "move: points are born without its velocity, and as a collider it sweeps none along",
        name, frame, was == is ? fmt::format("{}, which join other vertices", is) : fmt::format("{}, not {}", is, was));
}

}  // namespace

std::size_t OfferedPath::bytes() const
{
    if (is_of_start) return 0;
    return rest->triangles.size() * sizeof(Mesh::Triangle) +
           (meshes.size() + 1) * rest->positions.size() * sizeof(Vec3f);
}

void OfferedPath::list(std::vector<Mesh::Triangle>& triangles, std::vector<std::vector<Vec3f>>& positions) const
{
    triangles = rest->triangles;
    positions.push_back(rest->positions);
    for (const MeshPtr& mesh : meshes) positions.push_back(mesh->positions);
}

void OfferedPath::take(const std::vector<Mesh::Triangle>& triangles, const std::vector<std::vector<Vec3f>>& positions)
{
    if (positions.empty()) return StateReader::expect(is_of_start);
    constexpr int most_frames = 1 << 30;
    StateReader::expect(!is_of_start && positions.size() > 1 && !triangles.empty());
    StateReader::expect(-most_frames < first && first < most_frames);
    const std::size_t vertices = positions.front().size();
    for (const Mesh::Triangle& triangle : triangles)
        for (const std::int32_t corner : triangle)
            StateReader::expect(corner >= 0 && static_cast<std::size_t>(corner) < vertices);
    for (const std::vector<Vec3f>& P : positions) {
        StateReader::expect(P.size() == vertices);
        for (const Vec3f& at : P) StateReader::expect(at.allFinite());
        auto mesh = std::make_shared<Mesh>();
        mesh->name = name;
        mesh->positions = P;
        mesh->triangles = triangles;
        rest ? meshes.push_back(std::move(mesh)) : void(rest = std::move(mesh));
    }
}

void OfferedMeshes::start(std::int64_t frame)
{
    meshes_.clear();
    warnings_.clear();
    offers_.in_motion.clear();
    for (const auto& [name, object] : offers_.objects) {
        offer(name, object, frame);
        if (const auto found = meshes_.find(name); found != meshes_.end()) found->second.is_of_start = true;
    }
}

void OfferedMeshes::offer(const std::string& name, const ObjectPtr& object, std::int64_t frame)
{
    offers_.in_motion.erase(name);
    const auto mesh = std::dynamic_pointer_cast<const Mesh>(object);
    if (!mesh) {
        meshes_.erase(name);
        return;
    }
    const int number = static_cast<int>(frame);
    Offered& offered = meshes_[name];
    offered.is_of_start = false;
    if (offered.sequence && offered.sequence->last() >= number) {
        // Level sets of this frame may exist already, for the mesh that is replaced.
        std::map<int, MeshPtr> before = offered.sequence->meshes();
        before.erase(before.lower_bound(number), before.end());
        const MeshPtr rest = offered.sequence->rest();
        offered.sequence = before.empty() ? offered.replaced : std::make_shared<MeshSequence>(rest, std::move(before));
        offered.moving = nullptr;
    }
    offered.replaced = nullptr;
    if (offered.sequence && same_faces(*offered.sequence->rest(), *mesh)) {
        offered.sequence->append(number, mesh);
        return set_in_motion(name, offered);
    }
    if (offered.sequence && !std::exchange(offered.warned, true))
        warnings_.push_back(describe_change(name, frame, *offered.sequence->rest(), *mesh));
    const auto at_rest = std::make_shared<MeshSequence>(mesh, std::map<int, MeshPtr>{{number, mesh}});
    offered.replaced = std::exchange(offered.sequence, at_rest);
    offered.moving = nullptr;
}

void OfferedMeshes::set_in_motion(const std::string& name, Offered& offered)
{
    const std::shared_ptr<MeshSequence>& sequence = offered.sequence;
    if (!offered.moving) offered.moving = std::make_shared<AnimatedMesh>(sequence, constant_motion({}));
    offers_.in_motion[name] =
        std::make_shared<MeshOfFrame>(*sequence->at(sequence->last()), offered.moving, sequence->last());
}

std::vector<std::string> OfferedMeshes::take_warnings() { return std::exchange(warnings_, {}); }

std::vector<OfferedPath> OfferedMeshes::save() const
{
    std::vector<OfferedPath> paths;
    for (const auto& [name, offered] : meshes_) {
        const MeshSequence& sequence = *offered.sequence;
        OfferedPath& path = paths.emplace_back();
        path.name = name;
        path.first = sequence.first();
        path.rest = sequence.rest();
        path.is_of_start = offered.is_of_start;
        for (const auto& [frame, mesh] : sequence.meshes()) path.meshes.push_back(mesh);
    }
    return paths;
}

void OfferedMeshes::load(const std::vector<OfferedPath>& paths)
{
    for (const OfferedPath& path : paths) {
        if (path.meshes.empty()) continue;
        std::map<int, MeshPtr> meshes;
        for (const MeshPtr& mesh : path.meshes) meshes[path.first + static_cast<int>(meshes.size())] = mesh;
        Offered& offered = meshes_[path.name];
        offered = {.sequence = std::make_shared<MeshSequence>(path.rest, std::move(meshes)),
                   .is_of_start = path.is_of_start};
        if (path.meshes.size() > 1)
            set_in_motion(path.name, offered);
        else
            offers_.in_motion[path.name] = path.meshes.back();
    }
}

}  // namespace rapid
