// rapid.camera: the camera of pictures.
#include "bindings/host/maker.h"
#include "runtime/operators/picture.h"

namespace rapid {
namespace {

struct MakeCamera {
    std::optional<Vec3d> position, target;
    std::optional<double> fov;  // deg
    std::string group;

    static Maker declare()
    {
        return maker<MakeCamera>("camera", "Returns a camera; missing fields are fitted to the scene.")
            .param(&MakeCamera::position, "position", Value(), any_number(), "m", "position of the camera")
            .param(&MakeCamera::target, "target", Value(), any_number(), "m", "position at the centre of the view")
            .param(&MakeCamera::fov, "fov", Value(), between(1, 170), "",
                   "vertical angle of view in degrees; the default is 35")
            .param(&MakeCamera::group, "group", Value(), any_number(), "",
                   "group of points that the camera frames and follows, instead of the scene");
    }

    ObjectPtr make(MakeContext&) const
    {
        if (position && target && *position == *target)
            throw Error("position and target are equal; the camera needs a direction");
        auto camera = std::make_shared<CameraObject>();
        camera->position = position;
        camera->target = target;
        if (fov) camera->fov = *fov * EIGEN_PI / 180;
        camera->group = group;
        return camera;
    }
};
RAPID_MAKER(MakeCamera);

}  // namespace
}  // namespace rapid
