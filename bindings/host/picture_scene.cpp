#include "bindings/host/picture_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "runtime/graph/param.h"
#include "runtime/graph/points_object.h"
#include "runtime/operators/picture.h"
#include "runtime/shapes/mesh/ray_crossings.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/motion/level_set_sequence.h"

namespace rapid {
namespace {

// Returns the plane of a shape, if it is one. A shape without a surface mesh is infinite, and planes are the only
// infinite shapes that a picture can show. The distance to a plane is n · x - offset, which five points verify.
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

// Returns the settings of a `:picture` in this frame.
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

bool gives(const Node& node, const char* param)
{
    const auto given = node.arguments.find(param);
    return given != node.arguments.end() && !given->second.is_nil();
}

// Returns true if the mesh encloses all of a sample of these points.
bool encloses(const RayCrossings& mesh, std::span<const Vec3f> P)
{
    constexpr std::size_t sample_size = 63;
    const std::size_t step = std::max<std::size_t>(1, P.size() / sample_size);
    for (std::size_t i = 0; i < P.size(); i += step)
        if (mesh.from(P[i].cast<double>()).faces % 2 == 0) return false;
    return !P.empty();
}

PictureScene::Body::Role body_role_of(const PlannedNode& planned)
{
    // Shapes of dynamics are colliders; those of all other nodes emit points.
    return planned.node->type->kind == NodeKind::Dynamic ? PictureScene::Body::Collider : PictureScene::Body::Emitter;
}

}  // namespace

void SceneOfPlan::add(Described& to, const ObjectPtr& object, const Eigen::Affine3d& placement,
                      const Argument& given_by)
{
    const bool moved = !placement.matrix().isIdentity(0);
    const PictureScene::Body::Role role = body_role_of(plan_.nodes[given_by.first]);
    const auto add_body = [&](const MeshPtr& mesh) {
        to.scene->bodies.push_back({moved ? transformed(mesh, placement) : mesh, role});
        to.given_by.push_back(given_by);
    };
    if (const auto mesh = std::dynamic_pointer_cast<const Mesh>(object)) return add_body(mesh);
    const auto shape = std::dynamic_pointer_cast<const Shape>(object);
    if (!shape) return;
    const auto [entry, fresh] = surfaces_.try_emplace(object);
    if (fresh) {
        const auto before = surfaces_before_.find(object);
        entry->second = before != surfaces_before_.end() ? before->second : shape->surface();
    }
    if (entry->second) {
        add_body(entry->second);
    } else if (std::optional<PictureScene::Plane> plane = plane_of(*shape)) {
        const Vec3d on = placement * (plane->offset * plane->normal);
        plane->normal = (placement.linear() * plane->normal).normalized();
        plane->offset = plane->normal.dot(on);
        to.scene->planes.push_back(*plane);
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

// Finds the colliders that enclose a source of points, or initial points, when the scene begins. The first frame
// decides, so that a collider looks the same in all frames, whichever frames are drawn.
std::set<SceneOfPlan::Argument> SceneOfPlan::find_vessels()
{
    std::set<Argument> vessels;
    const Described first = describe(plan_.first_frame());
    std::vector<std::span<const Vec3f>> sources;
    for (const PictureScene::Body& body : first.scene->bodies)
        if (body.role == PictureScene::Body::Emitter) sources.emplace_back(body.mesh->positions);
    std::vector<std::vector<Vec3f>> places;  // of points; a column may hold one shared value
    for (const PlannedNode& planned : plan_.nodes)
        for (const auto& [name, value] : planned.node->arguments)
            if (const auto given = value.object<PointsObject>();
                given && body_role_of(planned) == PictureScene::Body::Emitter) {
                std::vector<Vec3f>& P = places.emplace_back(given->points.size());
                for (std::size_t i = 0; i < P.size(); ++i) P[i] = given->points.P()[i];
            }
    sources.insert(sources.end(), places.begin(), places.end());
    for (std::size_t b = 0; b < first.given_by.size() && !sources.empty(); ++b) {
        const PictureScene::Body& body = first.scene->bodies[b];
        if (body.role != PictureScene::Body::Collider) continue;
        const Box3f bounds = body.mesh->bounds();
        std::optional<RayCrossings> crossings;  // built lazily: it costs a pass over the mesh
        const auto is_inside = [&](const auto& P) {
            if (P.empty() || !bounds.contains(P.front())) return false;
            if (!crossings) crossings.emplace(body.mesh);
            return encloses(*crossings, P);
        };
        if (std::any_of(sources.begin(), sources.end(), is_inside)) vessels.insert(first.given_by[b]);
    }
    return vessels;
}

std::shared_ptr<const PictureScene> SceneOfPlan::at(std::int64_t frame)
{
    if (still_) return still_;
    if (!vessels_) vessels_ = find_vessels();
    Described described = describe(frame);
    std::vector<PictureScene::Body> shown;
    for (std::size_t b = 0; b < described.given_by.size(); ++b) {
        PictureScene::Body& body = described.scene->bodies[b];
        const bool collides = body.role == PictureScene::Body::Collider;
        body.is_vessel = collides && vessels_->count(described.given_by[b]) > 0;
        if (collides ? described.colliders : described.emitters) shown.push_back(std::move(body));
    }
    described.scene->bodies = std::move(shown);
    if (!described.colliders) described.scene->planes.clear();
    if (!described.moves) still_ = described.scene;
    return described.scene;
}

SceneOfPlan::Described SceneOfPlan::describe(std::int64_t frame)
{
    surfaces_before_ = std::exchange(surfaces_, {});
    Described result;
    result.scene = std::make_shared<PictureScene>();
    for (std::size_t n = 0; n < plan_.nodes.size(); ++n) {
        const Node& node = *plan_.nodes[n].node;
        const PlannedSimulation& simulation = plan_.simulations[plan_.nodes[n].simulation];
        const FrameClock clock{simulation.fps, simulation.start, simulation.subframes};
        const Frame now = clock.at(static_cast<double>(frame));
        if (node.type->name == "picture") {
            add_look(result, node, now, simulation.fps);
            continue;
        }
        Eigen::Affine3d placement = Eigen::Affine3d::Identity();
        if (const auto transform = node.arguments.find("transform"); transform != node.arguments.end()) {
            MotionPtr motion;
            read_value(*node.type->find("transform"), transform->second, motion);
            if (motion) placement = motion->at(now).affine();
            result.moves = result.moves || (motion && motion->varies());
        }
        for (const auto& [name, value] : node.arguments) {
            if (name == "transform") continue;
            const FrameFunction* function = value.function();
            const Value given = function ? function->call(now) : value;
            result.moves = result.moves || function;
            const Argument argument{n, name};
            if (const auto body = given.object<AnimatedMesh>()) {
                result.moves = true;
                add(result, body->at(clock, frame), placement, argument);
            } else if (const auto shape = given.object<AnimatedShape>()) {
                result.moves = true;
                add(result, shape->rest(), placement * shape->motion()->at(now).affine(), argument);
            } else if (const auto deforming = given.object<DeformingLevelSet>()) {
                result.moves = true;
                add(result, deforming->mesh().at(clock, frame), placement, argument);
            } else if (const auto sequence = given.object<LevelSetSequence>()) {
                result.moves = true;
                const auto number = static_cast<double>(frame);
                add(result, sequence->over({clock.fps, clock.start}, number, number), placement, argument);
            } else if (const ObjectPtr* object = given.get<ObjectPtr>()) {
                add(result, *object, placement, argument);
            }
        }
    }
    return result;
}

// Applies a `:picture`: its settings override those of earlier ones. fps: of the points, whose frame may have several
// steps.
void SceneOfPlan::add_look(Described& to, const Node& node, const Frame& now, double fps)
{
    const PictureNode picture = picture_at(node, now);
    PointStyle style{.group = picture.group};
    if (gives(node, "blend")) style.additive = picture.blend == "add";
    if (gives(node, "shutter")) style.shutter = picture.shutter / fps;
    if (gives(node, "draw")) style.cards = picture.draw == "cards";
    if (style.additive || style.shutter || style.cards) to.scene->styles.push_back(style);
    if (const CameraPtr camera = picture.camera.at(now.number))
        to.scene->camera = {camera->position, camera->target, camera->fov, camera->group};
    if (gives(node, "emitters")) to.emitters = picture.emitters;
    if (gives(node, "colliders")) to.colliders = picture.colliders;
    if (gives(node, "grid")) to.scene->grid = picture.grid;
    to.moves = to.moves || picture.camera.keys.size() > 1 || has_functions(node);
}

}  // namespace rapid
