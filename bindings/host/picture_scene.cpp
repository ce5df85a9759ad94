#include "bindings/host/picture_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "runtime/graph/param.h"
#include "runtime/operators/picture.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/motion/level_set_sequence.h"

namespace rapid {
namespace {

// A shape without a surface mesh is infinite. Among infinite shapes a picture can show planes. The distance of a plane
// is n · x - offset, which five points verify.
std::optional<PictureScene::Plane> plane_of(const Shape& shape)
{
    const std::array<Vec3d, 5> P = {Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1), Vec3d(-3, 5, 7)};
    std::array<double, 5> phi{};
    shape.distance(P, phi, {});
    const PictureScene::Plane plane{Vec3d(phi[1], phi[2], phi[3]) - Vec3d::Constant(phi[0]), -phi[0]};
    // Each distance is rounded at a magnitude of up to |offset|.
    const double rounding = 1e-9 * (1 + std::abs(phi[0]));
    const bool linear = std::abs(plane.normal.dot(P[4]) - plane.offset - phi[4]) <= 100 * rounding;
    if (!linear || std::abs(plane.normal.norm() - 1) > rounding) return std::nullopt;
    return plane;
}

// What a `:picture` says in this frame.
PictureNode picture_at(const Node& node, const Frame& now)
{
    std::map<std::string, Value> arguments = node.arguments;
    for (auto& [name, value] : arguments)
        if (const FrameFunction* function = value.function()) value = function->call(now);
    PictureNode picture;
    assign_arguments(node.type->params, arguments, &picture);
    return picture;
}

bool has_functions(const Node& node)
{
    return std::any_of(node.arguments.begin(), node.arguments.end(),
                       [](const auto& argument) { return argument.second.function() != nullptr; });
}

// fps: of the points, whose frame may have several steps.
void add_look(PictureScene& scene, const PictureNode& picture, const Frame& now, double fps)
{
    scene.styles.push_back({picture.group, picture.blend == "add", picture.shutter / fps});
    if (const CameraPtr camera = picture.camera.at(now.number))
        scene.camera = {camera->position, camera->target, camera->fov, camera->group};
}

}  // namespace

void SceneOfPlan::add(PictureScene& scene, const ObjectPtr& object, const Eigen::Affine3d& place,
                      PictureScene::Body::Role role)
{
    const bool moved = !place.matrix().isIdentity(0);
    if (const auto mesh = std::dynamic_pointer_cast<const Mesh>(object)) {
        scene.bodies.push_back({moved ? transformed(mesh, place) : mesh, role});
        return;
    }
    const auto shape = std::dynamic_pointer_cast<const Shape>(object);
    if (!shape) return;
    const auto [entry, fresh] = surfaces_.try_emplace(object);
    if (fresh) {
        const auto before = surfaces_before_.find(object);
        entry->second = before != surfaces_before_.end() ? before->second : shape->surface();
    }
    if (entry->second) {
        scene.bodies.push_back({moved ? transformed(entry->second, place) : entry->second, role});
    } else if (std::optional<PictureScene::Plane> plane = plane_of(*shape)) {
        const Vec3d on = place * (plane->offset * plane->normal);
        plane->normal = (place.linear() * plane->normal).normalized();
        plane->offset = plane->normal.dot(on);
        scene.planes.push_back(*plane);
    }
}

bool SceneOfPlan::may_have_colliders() const
{
    return std::any_of(plan_.nodes.begin(), plan_.nodes.end(), [](const PlannedNode& planned) {
        const auto& arguments = planned.node->arguments;
        return planned.node->type->kind == NodeKind::Dynamic &&
               std::any_of(arguments.begin(), arguments.end(), [](const auto& argument) {
                   return argument.first != "transform" &&
                          (argument.second.function() || argument.second.template get<ObjectPtr>());
               });
    });
}

std::shared_ptr<const PictureScene> SceneOfPlan::at(std::int64_t frame)
{
    if (still_) return still_;
    surfaces_before_ = std::exchange(surfaces_, {});
    auto scene = std::make_shared<PictureScene>();
    bool moves = false, emitters = true, colliders = true;
    for (const PlannedNode& planned : plan_.nodes) {
        // Shapes of dynamics are colliders; those of all other nodes emit points.
        const auto role =
            planned.node->type->kind == NodeKind::Dynamic ? PictureScene::Body::Collider : PictureScene::Body::Emitter;
        const PlannedSimulation& simulation = plan_.simulations[planned.simulation];
        const FrameClock clock{simulation.fps, simulation.start, simulation.subframes};
        const Frame now = clock.at(static_cast<double>(frame));
        if (planned.node->type->name == "picture") {
            const PictureNode picture = picture_at(*planned.node, now);
            add_look(*scene, picture, now, simulation.fps);
            emitters = emitters && picture.emitters;
            colliders = colliders && picture.colliders;
            scene->grid = scene->grid && picture.grid;
            moves = moves || picture.camera.keys.size() > 1 || has_functions(*planned.node);
            continue;
        }
        Eigen::Affine3d place = Eigen::Affine3d::Identity();
        if (const auto transform = planned.node->arguments.find("transform");
            transform != planned.node->arguments.end()) {
            MotionPtr motion;
            read_value(*planned.node->type->find("transform"), transform->second, motion);
            if (motion) place = motion->at(now).affine();
            moves = moves || (motion && motion->varies());
        }
        for (const auto& [name, value] : planned.node->arguments) {
            if (name == "transform") continue;
            const FrameFunction* function = value.function();
            const Value given = function ? function->call(now) : value;
            moves = moves || function;
            if (const auto body = given.object<AnimatedMesh>()) {
                moves = true;
                add(*scene, body->at(clock, frame), place, role);
            } else if (const auto shape = given.object<AnimatedShape>()) {
                moves = true;
                add(*scene, shape->rest(), place * shape->motion()->at(now).affine(), role);
            } else if (const auto deforming = given.object<DeformingLevelSet>()) {
                moves = true;
                add(*scene, deforming->mesh().at(clock, frame), place, role);
            } else if (const auto sequence = given.object<LevelSetSequence>()) {
                moves = true;
                const auto number = static_cast<double>(frame);
                add(*scene, sequence->over({clock.fps, clock.start}, number, number), place, role);
            } else if (const ObjectPtr* object = given.get<ObjectPtr>()) {
                add(*scene, *object, place, role);
            }
        }
    }
    std::erase_if(scene->bodies, [&](const PictureScene::Body& body) {
        return !(body.role == PictureScene::Body::Emitter ? emitters : colliders);
    });
    if (!colliders) scene->planes.clear();
    if (!moves) still_ = scene;
    return scene;
}

}  // namespace rapid
