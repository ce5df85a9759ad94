// transfer: gives points the attributes of the nearest position on a mesh. Attributes of vertices and corners are
// linear on each face; attributes of faces are constant on it.
//
// A moving or deforming mesh is used in its state at the end of the frame.
#include <fmt/format.h>

#include <cmath>

#include "runtime/base/parallel.h"
#include "runtime/graph/node.h"
#include "runtime/operators/emit/birth_source.h"
#include "runtime/points/attribute_like.h"
#include "runtime/points/members.h"
#include "runtime/shapes/mesh/nearest_on_triangle.h"
#include "runtime/shapes/motion/mesh_surface.h"

namespace rapid {
namespace {

struct TransferSource {
    static constexpr std::string_view param_type = "mesh";

    MeshPtr still;
    std::shared_ptr<const AnimatedMesh> moving;

    const MeshPtr& rest() const { return moving ? moving->rest() : still; }
};

void read_value(const Param& param, const Value& value, TransferSource& source)
{
    source = {};
    if (!(source.moving = value.object<AnimatedMesh>())) read_value(param, value, source.still);
}

struct Transfer {
    TransferSource source;
    std::vector<std::string> attributes;
    double distance;
    std::string group;

    static NodeType declare()
    {
        return node<Transfer>("transfer", "Gives points the attributes of the nearest position on a mesh.")
            .reads("P")
            .param(&Transfer::source, "source", Value(), any_number(), "", "mesh, which may move or deform")
            .required()
            .constant()
            .param(&Transfer::attributes, "attributes", Value(), any_number(), "",
                   "names of attributes of the mesh's vertices, corners or faces; the default is all")
            .constant()
            .param(&Transfer::distance, "distance", std::numeric_limits<double>::infinity(), or_infinity(at_least(0)),
                   "m", "distance beyond which points keep their values");
    }

    void uses(Uses& uses) const
    {
        for (const std::string& name : names()) {
            std::visit([&](const auto& c) { uses.makes.push_back(attribute_like(name, c.fallback())); },
                       *values_.values().find(name));
            uses.writes.push_back(name);
        }
    }

    // Throws Error if the mesh lacks a requested attribute, or has no attributes.
    void check() const
    {
        if (known_ != source.rest()) {
            known_ = source.rest();
            values_ = BirthSource(known_, "");
            surface_ = mesh_surface(known_);
        }
        const std::vector<std::string> there = values_.inherited();
        if (there.empty())
            throw Error(fmt::format("the mesh \"{}\" has no attributes; nothing can be transferred", known_->name));
        for (const std::string& name : attributes)
            if (std::find(there.begin(), there.end(), name) == there.end()) {
                const std::string near = did_you_mean(name, there);
                throw Error(fmt::format("attributes: the mesh \"{}\" has no \"{}\"{}", known_->name, name,
                                        near.empty() ? fmt::format("; it has {}", fmt::join(there, ", ")) : near));
            }
        for (const std::string& name : names())
            if (const AttributeSpec* known = known_attribute(name);
                known && type_of(known->fallback) != type_of(*values_.values().find(name)))
                throw Error(fmt::format("the mesh \"{}\" has \"{}\" as {}; it must be {}", known_->name, name,
                                        type_name(type_of(*values_.values().find(name))),
                                        type_name(type_of(known->fallback))));
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        const FrameClock clock = flow.simulation->clock();
        if (!source.moving) {
            give(flow.points, known_, *surface_, values_, Pose(), now);
        } else if (!source.moving->deforms()) {
            // Points are transformed to the frame of the mesh at rest.
            give(flow.points, known_, *surface_, values_, source.moving->motion()->at(now.frame), now);
        } else {
            const MeshPtr mesh = source.moving->at(clock, static_cast<std::int64_t>(std::ceil(now.frame.number)));
            give(flow.points, mesh, *mesh_surface(mesh), BirthSource(mesh, ""), Pose(), now);
        }
        return flow;
    }

private:
    std::vector<std::string> names() const { return attributes.empty() ? values_.inherited() : attributes; }

    void give(PointSet& points, const MeshPtr& mesh, const MovingBody& surface, const BirthSource& values,
              const Pose& pose, const Evaluation& now) const
    {
        // The nearest position of each point; its element is below 0 if the point keeps its values.
        std::vector<Birthplace> birthplaces(points.size());
        const Strided<std::uint8_t> members = members_of(points, group);
        const Strided<Vec3f> P = std::as_const(points).P().read();
        const Eigen::Affine3d to_rest = pose.affine().inverse();
        for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                if (members[i]) birthplaces[i] = nearest(*mesh, surface, to_rest * P[i].cast<double>(), pose.scale);
        });
        for (const std::string& name : names()) {
            const AnyColumn* any = values.values().find(name);
            if (!any || !now.keeps(name)) continue;
            std::visit(
                [&]<class T>(const Column<T>& from) {
                    const Strided<T> column = from.read();
                    points.add(attribute_like(name, from.fallback()));
                    const std::span<T> to = points.column<T>(name).write();
                    for_each_chunk(to.size(), [&](std::size_t begin, std::size_t end) {
                        for (std::size_t i = begin; i < end; ++i)
                            if (birthplaces[i].element >= 0)
                                to[i] = turned(name, values.value(column, birthplaces[i]), pose);
                    });
                },
                *any);
        }
    }

    // Normals turn with the mesh.
    template <class T>
    static T turned(const std::string& name, const T& value, const Pose& pose)
    {
        if constexpr (std::is_same_v<T, Vec3f>)
            if (name == "N") return (pose.rotation * value.template cast<double>()).template cast<float>();
        return value;
    }

    Birthplace nearest(const Mesh& mesh, const MovingBody& surface, const Vec3d& P, double scale) const
    {
        Birthplace place;
        const std::int32_t face = surface.material_at(P, 0).face;
        const Mesh::Triangle& t = mesh.triangles[static_cast<std::size_t>(face)];
        const auto corner = [&](int k) -> Vec3d {
            return mesh.positions[static_cast<std::size_t>(t[k])].cast<double>();
        };
        const Vec3d a = corner(0), b = corner(1), c = corner(2);
        const auto [b1, b2] = nearest_weights(P, a, b, c);
        if (scale * (P - (a + b1 * (b - a) + b2 * (c - a))).norm() > distance) return place;
        place.element = face;
        place.b1 = static_cast<float>(b1);
        place.b2 = static_cast<float>(b2);
        return place;
    }

    // A cache for the mesh at rest.
    mutable MeshPtr known_;
    mutable BirthSource values_;
    mutable std::shared_ptr<const MovingBody> surface_;
};
RAPID_NODE(Transfer);

}  // namespace
}  // namespace rapid
