// What a picture shows and from where: options, the shapes of the scene, the camera.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"
#include "runtime/vec.h"

namespace rapid {

// What a user may choose; the rest is chosen automatically.
struct PictureOptions {
    int width = 1280, height = 720;
    std::optional<Vec3d> position = {};  // of the camera, m
    std::optional<Vec3d> target = {};    // where it looks
    std::optional<double> fov = {};      // radians, from the lower to the upper edge
    bool grid = true;                    // lines on the ground, unless a plane of the scene is the ground
};

// How points look. What a style leaves open is as the styles before it say.
struct PointStyle {
    std::string group = {};              // whose points; empty: all
    std::optional<bool> additive = {};   // they shine: they add light, and take none
    std::optional<double> shutter = {};  // s that the picture is exposed, up to the frame's time
};

// A camera as a scene gives it; what it leaves open is fitted.
struct SceneCamera {
    std::optional<Vec3d> position = {}, target = {};  // m
    std::optional<double> fov = {};                   // radians, vertical
    std::string group = {};                           // whose points are framed; empty: the scene
};

// What is drawn besides the points of a frame, in world space, and how those are drawn.
struct PictureScene {
    struct Body {
        MeshPtr mesh;
        enum Role { Collider, Emitter } role = Collider;
        bool is_vessel = false;  // a collider with points in it: the sides between them and the viewer are left out
    };
    struct Plane {
        Vec3d normal = Vec3d::UnitY();
        double offset = 0;  // its points have normal · x = offset
    };
    std::vector<Body> bodies;
    std::vector<Plane> planes;
    std::vector<PointStyle> styles;  // the later one counts
    SceneCamera camera;
    bool grid = true;  // lines on the ground, unless a plane is the ground
};

struct Camera {
    Vec3d position = {3, 2, 5}, target = Vec3d::Zero();
    double fov = 0.61;  // radians, vertical

    // The picture's x, y (pixels from its left upper corner, pixel centres at .5) and the depth (m along the view).
    // Depth at most 0: not in front of the camera.
    Vec3d project(const Vec3d& P, int width, int height) const;
};

// What a sequence keeps, so that neither the camera nor the colours jump.
struct PictureView {
    Camera camera;
    double full_speed = 1;    // m/s, the upper end of the colour ramp
    double least_radius = 1;  // pixels
    Box3d bounds;             // what the camera is fitted to, m
    // The part of the world that a given camera looks at, m. The ground is drawn there, wherever points go. Without it,
    // the ground is drawn at the bounds.
    std::optional<Box3d> ground = {};
    double line_spacing = 1;  // m, of the lines on the ground
};

}  // namespace rapid
