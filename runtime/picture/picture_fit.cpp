#include "runtime/picture/picture_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/points/members.h"
#include "runtime/points/state_archive.h"

namespace rapid {
namespace {

// m/s². The speed of points that fall through the scene sets the scale of the speed colours.
constexpr double gravity = 9.81;
constexpr double look_ahead = 0.5;  // s: points are extrapolated by this time in the first frame
constexpr double glide = 0.35;      // s: time constant of the camera's move back
constexpr double zoom = 0.2;        // s: time constant of the zoom to the size of a followed group
constexpr double margin = 1.06;     // the view exceeds the bounds by this factor
constexpr double room = 1.25;       // the bounds grow by this factor when something leaves them
constexpr double usual_fov = 0.61;  // radians
const Vec3d view_from = Vec3d(0.55, 0.32, 1.0).normalized();  // from the scene to the camera

// Returns the bounds of the points without the outermost hundredth along each axis, so that a stray does not make the
// rest small. Includes the positions after the time `ahead`, but not below `floor`.
Box3d trimmed_bounds(const PointSet& points, const std::string& group, double ahead, double floor)
{
    const Strided<std::uint8_t> members = members_of(points, group);
    constexpr std::size_t sample_size = 20000;
    const std::size_t step = std::max<std::size_t>(1, points.size() / sample_size);
    const Strided<Vec3f> all_P = points.P().read(), all_v = points.v().read();
    const Column<float>* pscale = points.find<float>("pscale");
    std::vector<double> lows[3], highs[3];  // bounds of the balls
    for (std::size_t i = 0; i < points.size(); i += group.empty() ? step : 1) {
        if (!members[i]) continue;
        const Vec3d P = all_P[i].cast<double>();
        Vec3d later = P + ahead * all_v[i].cast<double>();
        later.y() = std::max(later.y(), std::min(P.y(), floor));
        if (!P.allFinite() || !later.allFinite()) continue;
        const double radius = pscale && std::isfinite((*pscale)[i]) ? std::max(0.0, double{(*pscale)[i]}) : 0;
        for (int axis = 0; axis < 3; ++axis)
            for (const Vec3d& at : {P, later}) {
                lows[axis].push_back(at[axis] - radius);
                highs[axis].push_back(at[axis] + radius);
                if (ahead == 0) break;
            }
    }
    Box3d bounds;
    if (lows[0].empty()) return bounds;
    const auto excluded = static_cast<std::ptrdiff_t>(lows[0].size() / 200);
    for (int axis = 0; axis < 3; ++axis) {
        const auto low = lows[axis].begin() + excluded, high = highs[axis].end() - 1 - excluded;
        std::nth_element(lows[axis].begin(), low, lows[axis].end());
        bounds.min()[axis] = *low;
        std::nth_element(highs[axis].begin(), high, highs[axis].end());
        bounds.max()[axis] = *high;
    }
    return bounds;
}

double fast_speed(const PointSet& points)
{
    constexpr std::size_t sample_size = 20000;
    const std::size_t step = std::max<std::size_t>(1, points.size() / sample_size);
    const Strided<Vec3f> v = points.v().read();
    std::vector<double> speeds;
    for (std::size_t i = 0; i < points.size(); i += step) {
        const double speed = v[i].cast<double>().norm();
        if (std::isfinite(speed)) speeds.push_back(speed);
    }
    if (speeds.empty()) return 0;
    const auto high = speeds.begin() + static_cast<std::ptrdiff_t>(speeds.size() - 1 - speeds.size() / 50);
    std::nth_element(speeds.begin(), high, speeds.end());
    return *high;
}

Box3d about(const Box3d& box, double factor)
{
    const Vec3d half = 0.5 * factor * Vec3d::Constant(box.diagonal().norm());
    return Box3d(box.center() - half, box.center() + half);
}

Box3d scaled(const Box3d& box, double factor)
{
    const Vec3d half = 0.5 * factor * box.sizes();
    return Box3d(box.center() - half, box.center() + half);
}

// Returns a round spacing in metres that puts about eight lines across the scene.
double spacing_of_lines(const Box3d& bounds)
{
    const double ideal = std::max(1e-6, bounds.diagonal().norm()) / 8;
    const double decade = std::pow(10.0, std::floor(std::log10(ideal))), rest = ideal / decade;
    return decade * (rest < 2 ? 1 : rest < 5 ? 2 : 5);
}

// Returns the bounds of the scene's shapes: emitters in full, and colliders as far as they are near the moving points.
// A floor of a hundred metres is no reason to place the camera a hundred metres away.
Box3d shape_bounds(const PictureScene& scene, const Box3d& moving)
{
    Box3d bounds = moving, colliders;
    for (const PictureScene::Body& body : scene.bodies) {
        const Box3f box = body.mesh->bounds();
        if (box.isEmpty()) continue;
        if (body.role == PictureScene::Body::Emitter)
            bounds.extend(box.cast<double>());
        else
            colliders.extend(box.cast<double>());
    }
    if (colliders.isEmpty()) return bounds;
    if (bounds.isEmpty() || bounds.diagonal().norm() == 0) return bounds.merged(colliders);
    // Only a collider that dwarfs the rest is clipped.
    if (colliders.diagonal().norm() < 6 * bounds.diagonal().norm()) return bounds.merged(colliders);
    const Box3d near = about(bounds, 0.8).intersection(colliders);
    return near.isEmpty() ? bounds : bounds.merged(near);
}

// Returns the height of the lowest shape; nothing falls below it.
double floor_of(const PictureScene& scene)
{
    double floor = std::numeric_limits<double>::infinity();
    for (const PictureScene::Body& body : scene.bodies)
        floor = std::min(floor, static_cast<double>(body.mesh->bounds().min().y()));
    for (const PictureScene::Plane& plane : scene.planes)
        if (plane.normal.y() > 0.9 * plane.normal.norm()) floor = std::min(floor, plane.offset / plane.normal.y());
    return floor;
}

// Returns the given camera. The parts that are not given are chosen so that the box just fits and the camera looks at
// its centre.
Camera fitted(const Box3d& bounds, const PictureOptions& options, const SceneCamera& of_scene)
{
    Camera camera;
    camera.fov = options.fov.value_or(of_scene.fov.value_or(usual_fov));
    camera.target = options.target.value_or(of_scene.target.value_or(bounds.center()));
    if (const auto& given = options.position ? options.position : of_scene.position) {
        camera.position = *given;
        return camera;
    }
    const double vertical = std::tan(0.5 * camera.fov);
    const double horizontal = vertical * options.width / options.height;
    camera.position = camera.target + view_from;
    const Vec3d forward = -view_from, right = forward.cross(Vec3d::UnitY()).normalized(), up = right.cross(forward);
    double distance = 0;
    for (int c = 0; c < 8; ++c) {
        const Vec3d corner = margin * (bounds.corner(static_cast<Box3d::CornerType>(c)) - bounds.center()) +
                             (bounds.center() - camera.target);
        // At the distance D the corner is at depth D + forward · corner; it must be inside both edges.
        const double needed = std::max(std::abs(corner.dot(right)) / horizontal, std::abs(corner.dot(up)) / vertical);
        distance = std::max(distance, needed - forward.dot(corner));
    }
    camera.position = camera.target + view_from * std::max(distance, 1e-3);
    return camera;
}

// Returns the cube at the target that fills the picture's height, or one that reaches down to the ground if that is
// farther.
Box3d seen_by(const Camera& camera)
{
    const double distance = std::max((camera.target - camera.position).norm(), std::abs(camera.position.y()));
    const Vec3d half = Vec3d::Constant(distance * std::tan(0.5 * camera.fov));
    return Box3d(camera.target - half, camera.target + half);
}

// Returns true if there is a valid view. A snapshot may contain anything.
bool is_view(const std::optional<PictureView>& view)
{
    return view && !view->bounds.isEmpty() && view->bounds.sizes().allFinite() && view->line_spacing > 0 &&
           view->full_speed > 0 && std::isfinite(view->line_spacing + view->full_speed);
}

}  // namespace

// Moves the bounds by a fraction of the way to the goal. The last hundredth is invisible and ends the motion.
void PictureFit::approach(double part)
{
    Box3d& bounds = view_->bounds;
    bounds.min() += part * (goal_.min() - bounds.min());
    bounds.max() += part * (goal_.max() - bounds.max());
    const double left = std::max((goal_.min() - bounds.min()).norm(), (goal_.max() - bounds.max()).norm());
    if (left < 0.01 * goal_.diagonal().norm()) bounds = goal_;
}

PictureView PictureFit::next(const PointSet& points, const FrameInfo& frame)
{
    static const PictureOptions usual;
    static const PictureScene nothing;
    const PictureOptions& options = frame.picture ? *frame.picture : usual;
    const PictureScene& scene = frame.scene ? *frame.scene : nothing;

    const bool first = !settled();
    const bool has_seen = !seen_.isEmpty();
    if (!first)
        StateReader::expect(is_view(view_) && goal_.sizes().allFinite() && (!has_seen || seen_.sizes().allFinite()));
    const std::string& group = scene.camera.group;
    // A group is followed wherever it goes. As long as it has had no members, the scene is framed.
    Box3d moving = trimmed_bounds(points, group, first && group.empty() ? look_ahead : 0, floor_of(scene));
    const bool follows = !group.empty() && !(first && moving.isEmpty());
    if (first && !group.empty() && !follows) moving = trimmed_bounds(points, "", look_ahead, floor_of(scene));
    Box3d content = follows ? moving : shape_bounds(scene, moving);
    if (!content.isEmpty()) {
        // A single point or a flat sheet is extended to a metre or a tenth of the rest, to give the view a size.
        const double least = content.diagonal().norm() > 0 ? 0.1 * content.diagonal().norm() : 1.0;
        for (int axis = 0; axis < 3; ++axis)
            if (content.sizes()[axis] < least) {
                const double missing = 0.5 * (least - content.sizes()[axis]);
                content.min()[axis] -= missing;
                content.max()[axis] += missing;
            }
        if (follows)
            seen_ = content;
        else
            seen_.extend(content);
    }
    const Box3d all = seen_.isEmpty() ? Box3d(Vec3d::Constant(-1), Vec3d::Constant(1)) : seen_;
    const double passed = std::max(0.0, frame.time - time_);
    time_ = frame.time;
    if (first) {
        view_.emplace();
        view_->bounds = goal_ = all;
    } else if (!group.empty()) {
        // The group's centre is followed at once, its size gradually, like a zoom.
        view_->bounds.translate(all.center() - goal_.center());
        goal_ = all;
        approach(1 - std::exp(-passed / zoom));
    } else {
        // The view holds still while everything is in it. When something leaves, it moves back far enough to hold still
        // for a while.
        if (!scaled(goal_, margin).contains(all)) goal_ = scaled(goal_.merged(all), room);
        approach(1 - std::exp(-passed / glide));
    }
    view_->camera = fitted(view_->bounds, options, scene.camera);
    view_->ground.reset();
    if (options.position || scene.camera.position) view_->ground = seen_by(view_->camera);
    if (first) view_->line_spacing = spacing_of_lines(view_->ground.value_or(all));

    const double fall = std::sqrt(gravity * view_->bounds.diagonal().norm());
    view_->full_speed = std::max({first ? 0.0 : view_->full_speed, fast_speed(points), 0.7 * fall, 1e-6});

    // Few points are drawn as visible dots, many as fine grains.
    max_points_ = std::max(max_points_, points.size());
    const double dots = 2.6 * std::pow(std::max<double>(1000, static_cast<double>(max_points_)) / 1000, -0.16);
    view_->min_radius = std::max(0.75, dots) * options.height / 720;
    return *view_;
}

}  // namespace rapid
