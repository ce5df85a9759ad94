// Poses the meshes of a glTF file. Normals become N, colours Cd and Alpha. Faces are in groups named after their mesh,
// the node that has it, and their material.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <compare>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/math/normal_map.h"
#include "runtime/shapes/mesh/gltf_file.h"

namespace rapid {
namespace {

// Returns the value of a channel at a time (glTF 2.0, appendix C).
std::vector<double> sampled(const GltfChannel& channel, double time)
{
    const std::size_t keys = channel.times.size(), n = channel.numbers;
    const bool cubic = channel.interpolation == GltfChannel::Cubic;
    const std::size_t after =
        std::upper_bound(channel.times.begin(), channel.times.end(), time) - channel.times.begin();
    const std::size_t from = after == 0 ? 0 : after - 1, to = std::min(after, keys - 1);
    // part: 0 is the tangent before a key of a cubic spline, 1 its value, 2 the tangent after it.
    const auto key = [&](std::size_t k, std::size_t part, std::size_t c) {
        return static_cast<double>(channel.values[((cubic ? 3 * k + part : k)) * n + c]);
    };
    const double length = static_cast<double>(channel.times[to]) - channel.times[from];
    const double s = length > 0 ? (time - channel.times[from]) / length : 0;
    std::vector<double> value(n);
    for (std::size_t c = 0; c < n; ++c) {
        const double a = key(from, 1, c), b = key(to, 1, c);
        if (channel.interpolation == GltfChannel::Step || !(length > 0))
            value[c] = a;
        else if (cubic)
            value[c] = (2 * s * s * s - 3 * s * s + 1) * a + length * (s * s * s - 2 * s * s + s) * key(from, 2, c) +
                       (3 * s * s - 2 * s * s * s) * b + length * (s * s * s - s * s) * key(to, 0, c);
        else
            value[c] = a + s * (b - a);
    }
    if (channel.path == GltfChannel::Rotation && channel.interpolation == GltfChannel::Linear && length > 0) {
        const auto rotation = [&](std::size_t k) {
            return Eigen::Quaterniond(key(k, 1, 3), key(k, 1, 0), key(k, 1, 1), key(k, 1, 2)).normalized();
        };
        const Eigen::Vector4d turned = rotation(from).slerp(s, rotation(to)).coeffs();
        value.assign(turned.data(), turned.data() + 4);
    }
    return value;
}

class GltfPose {
public:
    GltfPose(const GltfFile& file, const GltfAnimation* animation, double time) : file_(file)
    {
        mesh_.skipped = file.skipped;
        for (const GltfNode& node : file.nodes) {
            transforms_.push_back(node.transform);
            weights_.push_back(!node.mesh || !node.weights.empty() ? node.weights : file.meshes[*node.mesh].weights);
        }
        if (animation)
            for (const GltfChannel& channel : animation->channels) set(channel, sampled(channel, time));
        world_.resize(file.nodes.size());
        for (const std::size_t k : file.order) {
            const std::optional<std::size_t> parent = file.nodes[k].parent;
            world_[k] = transforms_[k].map();
            if (parent) world_[k] = world_[*parent] * world_[k];
        }
    }

    MeshFile mesh()
    {
        for (const std::size_t k : file_.shown)
            if (file_.nodes[k].mesh) append(k);
        complete();
        groups_.add_to(mesh_);
        return std::move(mesh_);
    }

private:
    void set(const GltfChannel& channel, const std::vector<double>& value)
    {
        GltfTransform& transform = transforms_[channel.node];
        switch (channel.path) {
            case GltfChannel::Translation:
                transform.translation = Eigen::Map<const Vec3d>(value.data());
                break;
            case GltfChannel::Rotation:
                transform.rotation = Eigen::Quaterniond(value.data());
                break;
            case GltfChannel::Scale:
                transform.scale = Eigen::Map<const Vec3d>(value.data());
                break;
            case GltfChannel::Weights:
                weights_[channel.node].assign(value.begin(), value.end());
                break;
        }
    }

    void append(std::size_t number)
    {
        const GltfNode& node = file_.nodes[number];
        const GltfMesh& mesh = file_.meshes[*node.mesh];
        const std::size_t copies = std::max<std::size_t>(1, node.instances.size());
        for (std::size_t copy = 0; copy < copies; ++copy)
            for (const GltfPrimitive& primitive : mesh.primitives) {
                const std::size_t names = groups_.add_names({mesh.name, node.name, primitive.material});
                append(primitive, number, node.instances.empty() ? nullptr : &node.instances[copy]);
                groups_.append(mesh_.triangles.size(), names);
            }
    }

    void append(const GltfPrimitive& primitive, std::size_t number, const Eigen::Affine3d* instance)
    {
        const GltfNode& node = file_.nodes[number];
        const std::size_t first = mesh_.positions.size(), vertices = primitive.positions.size();
        constexpr double bytes_a_vertex = 3 * 4 * sizeof(Vec3f);  // a growing list briefly takes three times its size
        if (const double bytes = bytes_a_vertex * static_cast<double>(first + vertices); !fits_in_memory(bytes))
            throw memory_exceeded(fmt::format("nodes with {} vertices", first + vertices), bytes, "split the file");
        if (first + vertices > std::numeric_limits<std::int32_t>::max())
            throw Error(fmt::format("{} vertices are too many for a mesh", first + vertices));
        std::vector<Vec3f> positions = primitive.positions, normals = primitive.normals;
        morph(primitive, weights_[number], positions, normals);
        // A skinned mesh follows its joints, and not its node (glTF 2.0, 3.7.3.3).
        const bool skinned = node.skin && !primitive.joints.empty();
        const Eigen::Affine3d map = instance ? world_[number] * *instance : world_[number];
        if (skinned)
            bend(primitive, file_.skins[*node.skin], positions, normals);
        else
            place(map, positions, normals);
        mesh_.positions.insert(mesh_.positions.end(), positions.begin(), positions.end());
        const bool mirrored = !skinned && map.linear().determinant() < 0;
        for (const Mesh::Triangle& t : primitive.triangles) {
            const Mesh::Triangle corners = t.array() + static_cast<std::int32_t>(first);
            mesh_.triangles.push_back(mirrored ? Mesh::Triangle(corners[0], corners[2], corners[1]) : corners);
        }
        if (!primitive.colours.empty()) {
            mesh_.colours.resize(first, Vec3f::Ones());  // parts without colours are white
            mesh_.alphas.resize(first, 1.0f);
            mesh_.colours.insert(mesh_.colours.end(), primitive.colours.begin(), primitive.colours.end());
            mesh_.alphas.insert(mesh_.alphas.end(), primitive.alphas.begin(), primitive.alphas.end());
        }
        if (normals.size() == vertices && !normals.empty()) append_values("N", normals, first);
        for (const auto& [name, values] : primitive.values)
            std::visit([&, &key = name](const auto& list) { append_values(key, list, first); }, values);
    }

    static void add(std::vector<Vec3f>& to, const std::vector<Vec3f>& offsets, float weight)
    {
        for (std::size_t i = 0; i < std::min(to.size(), offsets.size()); ++i) to[i] += weight * offsets[i];
    }

    static void morph(const GltfPrimitive& primitive, const std::vector<float>& weights, std::vector<Vec3f>& positions,
                      std::vector<Vec3f>& normals)
    {
        for (std::size_t k = 0; k < std::min(primitive.targets.size(), weights.size()); ++k) {
            add(positions, primitive.targets[k].positions, weights[k]);
            add(normals, primitive.targets[k].normals, weights[k]);
        }
    }

    static void place(const Eigen::Affine3d& map, std::vector<Vec3f>& positions, std::vector<Vec3f>& normals)
    {
        if (!map.matrix().isIdentity(0))
            for (Vec3f& P : positions) P = (map * P.cast<double>()).cast<float>();
        const Eigen::Matrix3d of_normals = normal_map(map.linear());
        for (Vec3f& N : normals) N = (of_normals * N.cast<double>()).stableNormalized().cast<float>();
    }

    // Moves each vertex by the mean of its joints' maps, with its weights (glTF 2.0, 3.7.3.3).
    void bend(const GltfPrimitive& primitive, const GltfSkin& skin, std::vector<Vec3f>& positions,
              std::vector<Vec3f>& normals) const
    {
        std::vector<Eigen::Matrix4d> maps;
        for (std::size_t k = 0; k < skin.joints.size(); ++k)
            maps.push_back((world_[skin.joints[k]] * skin.inverse_binds[k]).matrix());
        const std::size_t vertices = positions.size();
        const std::size_t influences = std::min(primitive.joints.size(), primitive.weights.size());
        std::vector<Eigen::Matrix4d> sums(vertices, Eigen::Matrix4d::Zero());
        for (std::size_t k = 0; k < influences; ++k)
            for (std::size_t c = 0; c < 4; ++c) {
                const float weight = primitive.weights[k][c];
                if (!(weight > 0)) continue;
                const std::uint32_t joint = primitive.joints[k][c];
                if (joint >= maps.size())
                    throw Error(fmt::format("a vertex has the joint {}; its skin has {}, from 0", joint, maps.size()));
                sums[k % vertices] += static_cast<double>(weight) * maps[joint];
            }
        for (std::size_t i = 0; i < vertices; ++i) {
            const double total = sums[i](3, 3);  // of the weights, which should be 1
            if (!(total > 0)) continue;
            Eigen::Affine3d map;
            map.matrix() = sums[i] / total;
            positions[i] = (map * positions[i].cast<double>()).cast<float>();
            if (i < normals.size())
                normals[i] = (normal_map(map.linear()) * normals[i].cast<double>()).stableNormalized().cast<float>();
        }
    }

    // Appends a value per vertex. Earlier vertices without one get 0.
    template <class T>
    void append_values(const std::string& name, const std::vector<T>& list, std::size_t first)
    {
        Mesh::VertexValues& values = mesh_.values.try_emplace(name, std::vector<T>()).first->second;
        auto* known = std::get_if<std::vector<T>>(&values);
        if (!known)
            return add_skipped(mesh_.skipped,
                               fmt::format("\"{}\" of a part, which has another type in other parts", name));
        known->resize(first, zero<T>());
        known->insert(known->end(), list.begin(), list.end());
    }

    template <class T>
    static T zero()
    {
        if constexpr (std::is_same_v<T, Vec3f>)
            return Vec3f::Zero();
        else
            return 0;
    }

    // Pads all lists to the number of vertices.
    void complete()
    {
        const std::size_t n = mesh_.positions.size();
        if (!mesh_.colours.empty()) {
            mesh_.colours.resize(n, Vec3f::Ones());
            mesh_.alphas.resize(n, 1.0f);
        }
        for (auto& [name, values] : mesh_.values)
            std::visit([n]<class T>(std::vector<T>& list) { list.resize(n, zero<T>()); }, values);
    }

    const GltfFile& file_;
    std::vector<GltfTransform> transforms_;
    std::vector<std::vector<float>> weights_;  // of the morph targets of each node
    std::vector<Eigen::Affine3d> world_;
    MeshFile mesh_;
    GroupsOfFaces groups_;
};

// What the position of a corner depends on in all poses.
struct MovedCorner {
    std::size_t copy;  // of a mesh at a node
    const GltfPrimitive* primitive;
    std::size_t vertex;
    bool skinned;

    Vec3f offset(const GltfPrimitive::Target& target) const
    {
        return vertex < target.positions.size() ? target.positions[vertex] : Vec3f(Vec3f::Zero());
    }
    std::size_t influences() const
    {
        return skinned ? std::min(primitive->joints.size(), primitive->weights.size()) / primitive->positions.size()
                       : 0;
    }

    std::strong_ordering operator<=>(const MovedCorner& other) const
    {
        const std::size_t targets = primitive->targets.size(), sets = influences();
        if (const auto order = std::tuple(copy, targets, sets) <=>
                               std::tuple(other.copy, other.primitive->targets.size(), other.influences());
            order != 0)
            return order;
        if (const auto order = compare(primitive->positions[vertex], other.primitive->positions[other.vertex]);
            order != 0)
            return order;
        for (std::size_t k = 0; k < targets; ++k)
            if (const auto order = compare(offset(primitive->targets[k]), other.offset(other.primitive->targets[k]));
                order != 0)
                return order;
        for (std::size_t k = 0; k < sets; ++k)
            for (std::size_t c = 0; c < 4; ++c)
                if (const auto order = influence(k, c) <=> other.influence(k, c); order != 0) return order;
        return std::strong_ordering::equal;
    }

private:
    static std::uint32_t bits(float number) { return std::bit_cast<std::uint32_t>(number + 0.0f); }  // -0 is 0
    static std::strong_ordering compare(const Vec3f& a, const Vec3f& b)
    {
        return std::tuple(bits(a.x()), bits(a.y()), bits(a.z())) <=> std::tuple(bits(b.x()), bits(b.y()), bits(b.z()));
    }
    // Returns the weight and joint. A joint without weight does not count.
    std::pair<std::uint32_t, std::uint32_t> influence(std::size_t set, std::size_t c) const
    {
        const std::size_t at = set * primitive->positions.size() + vertex;
        const float weight = primitive->weights[at][c];
        return {bits(weight), weight > 0 ? primitive->joints[at][c] : 0};
    }
};

}  // namespace

std::vector<std::int32_t> join_moved_alike(const GltfFile& file)
{
    std::map<MovedCorner, std::int32_t> vertices;
    std::vector<std::int32_t> vertex_of;
    std::size_t copy = 0;
    for (const std::size_t k : file.shown) {
        const GltfNode& node = file.nodes[k];
        if (!node.mesh) continue;
        const std::size_t last = copy + std::max<std::size_t>(1, node.instances.size());
        for (; copy < last; ++copy)
            for (const GltfPrimitive& primitive : file.meshes[*node.mesh].primitives)
                for (std::size_t i = 0; i < primitive.positions.size(); ++i)
                    vertex_of.push_back(vertices
                                            .try_emplace({copy, &primitive, i, node.skin.has_value()},
                                                         static_cast<std::int32_t>(vertices.size()))
                                            .first->second);
    }
    return vertex_of;
}

MeshFile posed(const GltfFile& file, const GltfAnimation* animation, double time)
{
    return GltfPose(file, animation, time).mesh();
}

MeshFile read_gltf_mesh(const std::filesystem::path& path)
{
    const GltfFile file = read_gltf(path);
    MeshFile mesh = posed(file);
    if (!file.animations.empty()) add_skipped(mesh.skipped, "its animations");
    return mesh;
}

}  // namespace rapid
