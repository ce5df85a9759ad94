// The contents and the viewpoint of a picture: options, the shapes of the scene, the camera.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

// Choices of the user. The rest is automatic.
struct PictureOptions {
    int width = 1280, height = 720;
    std::optional<Vec3d> position = {};  // of the camera, m
    std::optional<Vec3d> target = {};    // point that it looks at
    std::optional<double> fov = {};      // radians, vertical
    bool grid = true;                    // lines on the ground, unless a plane of the scene is the ground
};

// The look of points. Members that a style leaves open keep the value of earlier styles.
struct PointStyle {
    std::string group = {};              // group that it applies to; empty: all points
    std::optional<bool> additive = {};   // glowing: the points add light and block none
    std::optional<bool> cards = {};      // flat discs across the y axis of orient, instead of balls
    std::optional<double> shutter = {};  // s, length of the exposure, which ends at the frame's time
};

// A camera as stated by a scene. Members that it leaves open are fitted.
struct SceneCamera {
    std::optional<Vec3d> position = {}, target = {};  // m
    std::optional<double> fov = {};                   // radians, vertical
    std::string group = {};                           // group to frame; empty: the whole scene
};

// The shapes of a frame, in world space, and the styles of its points.
struct PictureScene {
    struct Body {
        MeshPtr mesh;
        enum Role { Collider, Emitter } role = Collider;
        bool is_vessel = false;  // a collider that contains points: sides facing the viewer are not drawn
    };
    struct Plane {
        Vec3d normal = Vec3d::UnitY();
        double offset = 0;  // the plane normal · x = offset
    };
    std::vector<Body> bodies;
    std::vector<Plane> planes;
    std::vector<PointStyle> styles;  // later ones take precedence
    SceneCamera camera;
    bool grid = true;  // lines on the ground, unless a plane is the ground
};

struct Camera {
    Vec3d position = {3, 2, 5}, target = Vec3d::Zero();
    double fov = 0.61;  // radians, vertical

    // Returns x and y in pixels from the upper left corner (pixel centres at .5) and the depth in m along the view. If
    // the depth is at most 0, P is not in front of the camera.
    Vec3d project(const Vec3d& P, int width, int height) const;
};

// The state that a sequence keeps so that neither the camera nor the colours jump.
struct PictureView {
    Camera camera;
    double full_speed = 1;  // m/s, the upper end of the colour ramp
    double min_radius = 1;  // pixels
    Box3d bounds;           // m, the box that the camera is fitted to
    // The part of the world that a given camera looks at, m. The ground is drawn there, wherever points go. Without it,
    // the ground is drawn at the bounds.
    std::optional<Box3d> ground = {};
    double line_spacing = 1;  // m, between the lines on the ground
};

}  // namespace rapid
