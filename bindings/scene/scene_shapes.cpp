// Shapes of a frame, and pictures of points with them.
#include "include/rapid/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "bindings/scene/scene_impl.h"
#include "bindings/scene/state_file_io.h"
#include "runtime/picture/frame_picture.h"
#include "runtime/picture/picture_fit.h"
#include "runtime/picture/png_file.h"

namespace rapid {
namespace {

constexpr char shapes_file_type[] = "shapes of a frame";

static_assert(sizeof(Vec3f) == 3 * sizeof(float) && sizeof(Mesh::Triangle) == 3 * sizeof(std::int32_t));

// A PictureScene in a file.
struct StoredScene {
    struct Body {
        std::vector<Vec3f> positions;
        std::vector<Mesh::Triangle> triangles;
        std::int32_t role = 0;
        bool is_vessel = false;

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(positions, triangles, role, is_vessel);
        }
    };
    std::vector<Body> bodies;
    PictureScene rest;  // without bodies

    StoredScene() = default;
    explicit StoredScene(const PictureScene& scene) : rest(scene)
    {
        rest.bodies.clear();
        for (const PictureScene::Body& body : scene.bodies)
            bodies.push_back({body.mesh->positions, body.mesh->triangles, body.role, body.is_vessel});
    }

    std::shared_ptr<const PictureScene> scene() &&
    {
        for (Body& body : bodies) {
            auto mesh = std::make_shared<Mesh>();
            mesh->positions = std::move(body.positions);
            mesh->triangles = std::move(body.triangles);
            const auto corners = static_cast<std::int32_t>(mesh->positions.size());
            for (const Mesh::Triangle& triangle : mesh->triangles)
                if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= corners) StateReader::fail();
            const bool emits = body.role == PictureScene::Body::Emitter;
            rest.bodies.push_back(
                {mesh, emits ? PictureScene::Body::Emitter : PictureScene::Body::Collider, body.is_vessel});
        }
        return std::make_shared<PictureScene>(std::move(rest));
    }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(bodies);
        auto planes = static_cast<std::uint32_t>(rest.planes.size());
        auto styles = static_cast<std::uint32_t>(rest.styles.size());
        keep(planes, styles);
        if constexpr (Archive::is_loading::value) {
            keep_room(keep, planes, rest.planes);
            keep_room(keep, styles, rest.styles);
        }
        for (PictureScene::Plane& plane : rest.planes) keep(plane.normal, plane.offset);
        for (PointStyle& style : rest.styles) keep(style.group, style.additive, style.cards, style.shutter);
        keep(rest.camera.position, rest.camera.target, rest.camera.fov, rest.camera.group, rest.grid);
    }

private:
    template <class Archive, class T>
    static void keep_room(const Archive& from, std::uint32_t count, std::vector<T>& list)
    {
        from.require(count);
        list.resize(count);
    }
};

}  // namespace

SceneShapes::SceneShapes() = default;
SceneShapes::SceneShapes(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

std::vector<ShapeMesh> SceneShapes::meshes() const
{
    std::vector<ShapeMesh> meshes;
    if (!data_) return meshes;
    for (const PictureScene::Body& body : data_->scene->bodies) {
        ShapeMesh& mesh = meshes.emplace_back();
        mesh.role = body.role == PictureScene::Body::Collider ? ShapeRole::Collider : ShapeRole::Emitter;
        mesh.corner_count = body.mesh->positions.size();
        mesh.positions = reinterpret_cast<const float*>(body.mesh->positions.data());
        mesh.triangle_count = body.mesh->triangles.size();
        mesh.triangles = reinterpret_cast<const std::int32_t*>(body.mesh->triangles.data());
        mesh.owner = body.mesh;
    }
    return meshes;
}

std::vector<ShapePlane> SceneShapes::planes() const
{
    std::vector<ShapePlane> planes;
    if (!data_) return planes;
    for (const PictureScene::Plane& plane : data_->scene->planes)
        planes.push_back({{plane.normal.x(), plane.normal.y(), plane.normal.z()}, plane.offset});
    return planes;
}

std::vector<std::string> SceneShapes::warnings() const { return data_ ? data_->warnings : std::vector<std::string>(); }

bool SceneShapes::operator==(const SceneShapes& other) const
{
    return (data_ ? data_->scene : nullptr) == (other.data_ ? other.data_->scene : nullptr);
}

Result<Done> SceneInside::save(const SceneShapes& shapes, const std::string& path)
{
    return with_file_name(path, [&] {
        const PictureScene none;
        write_state_file(path, shapes_file_type, "", StoredScene(shapes.data_ ? *shapes.data_->scene : none));
        return Done();
    });
}

Result<SceneShapes> SceneInside::load_shapes(const std::string& path)
{
    return with_file_name(path, [&] {
        auto data = std::make_shared<SceneShapes::Data>();
        data->scene = read_state_file<StoredScene>(path, shapes_file_type, "").scene();
        return SceneShapes(std::move(data));
    });
}

SceneShapes Scene::Impl::shapes_at(std::int64_t frame)
{
    const Running running(*this);
    if (!picture_scene) picture_scene = std::make_unique<SceneOfPlan>(*plan);
    auto data = std::make_shared<SceneShapes::Data>();
    data->scene = picture_scene->at(frame);
    data->warnings = session->take_warnings();
    log_warnings(data->warnings);
    return SceneShapes(std::move(data));
}

Result<SceneShapes> Scene::shapes(std::int64_t frame)
{
    return impl_->call(SceneError::FailedFrame, [&] { return impl_->shapes_at(frame); });
}

constexpr const char* smaller_size = "give a smaller size";

std::shared_ptr<const PictureOptions> picture_options(const PictureCamera& camera, PictureSize size)
{
    if (camera.fov && !(*camera.fov > 0 && *camera.fov < 180))
        refuse(fmt::format("fov = {}; it must be between 0 and 180 degrees", *camera.fov));
    const auto is_finite = [](const auto& place) {
        return !place || std::all_of(place->begin(), place->end(), [](double x) { return std::isfinite(x); });
    };
    if (!is_finite(camera.position) || !is_finite(camera.target))
        refuse("the camera's position and target must be finite");
    if (camera.position && camera.position == camera.target) refuse("the camera's position and target are equal");
    auto options = std::make_shared<PictureOptions>();
    options->width = size.width;
    options->height = size.height;
    if (camera.position) options->position = Vec3d(camera.position->data());
    if (camera.target) options->target = Vec3d(camera.target->data());
    if (camera.fov) options->fov = *camera.fov * M_PI / 180;
    return options;
}

bool SceneShapes::has_camera() const
{
    if (!data_) return false;
    const SceneCamera& camera = data_->scene->camera;
    return camera.position || camera.target || camera.fov || !camera.group.empty();
}

Result<PictureCamera> SceneInside::camera(const SceneFrame& frame, const SceneShapes& shapes,
                                          const PictureCamera& camera, PictureSize size)
{
    try {
        FrameInfo info;
        info.picture = picture_options(camera, size);
        info.scene = shapes.data_ ? shapes.data_->scene : nullptr;
        const Camera fitted = PictureFit().next(frame.data_->result.outputs.at(frame.output_), info).camera;
        const auto numbers = [](const Vec3d& x) { return std::array{x.x(), x.y(), x.z()}; };
        return PictureCamera{numbers(fitted.position), numbers(fitted.target), fitted.fov * 180 / M_PI};
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<std::string> SceneFrame::picture(const SceneShapes& shapes, const PictureCamera& camera, PictureSize size) const
{
    try {
        FrameInfo info;
        info.picture = picture_options(camera, size);
        info.scene = shapes.data_ ? shapes.data_->scene : nullptr;
        require_picture_memory(size.width, size.height, info.scene && !info.scene->bodies.empty(), 1, smaller_size);
        return encode_png(picture_of(data_->result.outputs.at(output_), info));
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<std::string> Scene::picture(const SceneFrame& frame, PictureSize size)
{
    return impl_->call(SceneError::WrongCall, [&] {
        const SceneFrame::Data& data = *frame.data_;
        if (data.scene != impl_->number) refuse("the frame belongs to another scene");
        FrameInfo info;
        info.number = static_cast<int>(frame.number());
        info.time = frame.time();
        info.fps = frame.fps();
        info.picture = picture_options({}, size);
        info.scene = impl_->shapes_at(frame.number()).data_->scene;
        require_picture_memory(size.width, size.height, !info.scene->bodies.empty(), 1, smaller_size);
        return encode_png(picture_of(data.result.outputs.at(frame.output_), info));
    });
}

}  // namespace rapid
