// Pictures of points: what an artist looks at first. Discs with soft edges and the shading of balls, nearest in front,
// over the shapes of the scene and a ground grid.
//
// The same bits for any number of threads. Works in linear light; colours are Cd where points have it, else the speed
// on a perceptual ramp; radii are pscale where it is seen, else a few pixels.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "runtime/picture/frame_info.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

// What a user may say of a picture; what is not said is chosen.
struct PictureOptions {
    int width = 1280, height = 720;
    std::optional<Vec3d> position = {};  // of the camera, m
    std::optional<Vec3d> target = {};    // where it looks
    double fov = 0.61;                   // radians, from the lower to the upper edge
    bool grid = true;                    // lines on the ground, where no plane of the scene is one
};

// What is seen besides the points, at this frame, in world space.
struct PictureScene {
    struct Body {
        MeshPtr mesh;
        enum Role { Collider, Emitter } role = Collider;
    };
    struct Plane {
        Vec3d normal = Vec3d::UnitY();
        double offset = 0;  // its points have normal · x = offset
    };
    std::vector<Body> bodies;
    std::vector<Plane> planes;
};

struct Camera {
    Vec3d position = {3, 2, 5}, target = Vec3d::Zero();
    double fov = 0.61;  // radians, vertical

    // The picture's x, y (pixels from its left upper corner, pixel centres at .5) and the depth (m along the view).
    // Depth at most 0: not in front of the camera.
    Vec3d project(const Vec3d& P, int width, int height) const;
};

// What stays the same over a sequence, so that neither the camera nor the colours jump.
struct PictureView {
    Camera camera;
    double full_speed = 1;    // m/s, the upper end of the colour ramp
    double least_radius = 1;  // pixels
    Box3d bounds;             // what the camera is fitted to, m
};

// Chooses the view of each frame from the ones before it: the camera is fitted to the first frame that has points
// (to them, to where they will be half a second later, and to the shapes), and from then on only glides back when
// points come near the edge of what it sees.
class PictureFit {
public:
    PictureView next(const PointSet& points, const FrameInfo& frame);

    // Whether there have been points. Before, the view is of the shapes alone and may still jump.
    bool settled() const { return most_points_ > 0; }

private:
    std::optional<PictureView> view_;
    Box3d seen_;  // all that was there so far
    double time_ = 0;
    std::size_t most_points_ = 0;
};

// 8 bits a channel, sRGB, rows from the top; shape [height][width][3].
struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;

    const std::uint8_t* pixel(int x, int y) const { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
};

Picture render(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
               const PictureView& view);

}  // namespace rapid
