// picture: the look of points in pictures, the camera, and which shapes are shown.
#include "runtime/operators/picture.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/graph/coupling.h"

namespace rapid {
namespace {

// Both are between the same two keys: a value that one of them leaves unset stays unset between them.
template <class T>
std::optional<T> interpolated_optional(const std::optional<T>& a, const std::optional<T>& b, double part)
{
    if (!a || !b) return part < 1 ? a : b;
    return T(*a + part * (*b - *a));
}

}  // namespace

CameraPtr CameraTrack::at(double frame) const
{
    if (keys.empty()) return nullptr;
    const auto next = std::find_if(keys.begin(), keys.end(),
                                   [&](const auto& key) { return static_cast<double>(key.first) >= frame; });
    if (next == keys.begin()) return next->second;
    if (next == keys.end()) return keys.rbegin()->second;
    const auto [first, a] = *std::prev(next);
    const auto [last, b] = *next;
    const double t = (frame - static_cast<double>(first)) / static_cast<double>(last - first);
    const double part = t * t * (3 - 2 * t);  // at rest at both keys
    auto camera = std::make_shared<CameraObject>();
    camera->position = interpolated_optional(a->position, b->position, part);
    camera->target = interpolated_optional(a->target, b->target, part);
    camera->fov = interpolated_optional(a->fov, b->fov, part);
    camera->group = part < 1 ? a->group : b->group;
    return camera;
}

void read_value(const Param& param, const Value& value, CameraTrack& field)
{
    field.keys.clear();
    if (value.is_nil()) return;
    if (CameraPtr camera = value.object<CameraObject>()) {
        field.keys[0] = std::move(camera);
        return;
    }
    const auto fault = [&] {
        return Error(
            fmt::format("{} = {}; it must be a rapid.camera {{ ... }}, cameras by frame {{[1] = a, [48] = b}}, or a "
                        "function of the frame that returns a camera",
                        param.name, describe(value)));
    };
    const Table* table = value.table();
    if (!table || !table->named.empty()) throw fault();
    std::int64_t frame = 0;
    for (const Value& key : table->list) field.keys[++frame] = key.object<CameraObject>();
    for (const auto& [number, key] : table->numbered) field.keys[number] = key.object<CameraObject>();
    for (const auto& [number, camera] : field.keys)
        if (!camera) throw fault();
    if (field.keys.empty()) throw fault();
}

void PictureNode::uses(Uses& uses) const
{
    for (const auto& [frame, key] : camera.keys)
        if (!key->group.empty()) uses.reads_groups.push_back(key->group);
}

NodeType PictureNode::declare()
{
    return node<PictureNode>("picture", "Sets how points and shapes look in pictures, without changing any point.")
        .takes("age")
        .takes("orient")
        .param(&PictureNode::blend, "blend", std::string("over"), any_number(), "",
               "over: nearer points hide others; add: points add their light and cast no shadow")
        .choices({"over", "add"})
        .param(&PictureNode::draw, "draw", std::string("balls"), any_number(), "",
               "cards: flat discs perpendicular to the y axis of orient, which show how points turn")
        .choices({"balls", "cards"})
        .param(&PictureNode::shutter, "shutter", 0.0, between(0, 1), "",
               "fraction of the frame for which the picture is exposed, so that moving points leave streaks")
        .param(&PictureNode::camera, "camera", Value(), any_number(), "",
               "camera made by rapid.camera, a function of the frame that returns one, or keys; by default fitted to "
               "the scene")
        .param(&PictureNode::emitters, "emitters", true, any_number(), "", "shows the shapes that emit points")
        .param(&PictureNode::colliders, "colliders", true, any_number(), "",
               "shows the shapes that points collide with")
        .param(&PictureNode::grid, "grid", true, any_number(), "",
               "draws lines on the ground, unless a plane of the scene is the ground");
}

RAPID_NODE(PictureNode);
RAPID_COUPLING("picture", PictureNode);

}  // namespace rapid
