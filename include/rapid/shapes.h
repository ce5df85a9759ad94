// The shapes of a scene in a frame, for renderers and viewers: those that its points collide with or are born from.
//
//   auto shapes = scene.shapes(frame->number());
//   for (const rapid::ShapeMesh& mesh : shapes->meshes()) draw(mesh);
//
// Errors, units and threads are those of rapid/scene.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "scene.h"

namespace rapid {

// Roles of a shape for the points.
enum class ShapeRole {
    Collider,  // they collide with it
    Emitter,   // they are born from it, or go to it
};

// A triangle mesh in world space: one of the scene, or the surface of a level set.
struct ShapeMesh {
    ShapeRole role = ShapeRole::Collider;     // to the points
    std::size_t corner_count = 0;             // of positions
    const float* positions = nullptr;         // shape [corner_count][3], m
    std::size_t triangle_count = 0;           // of triangles
    const std::int32_t* triangles = nullptr;  // shape [triangle_count][3], counter-clockwise seen from outside; from 0
    // Owner of the arrays, which keeps them valid and unchanged. Meshes of two frames with the same owner are the same
    // mesh, as for a shape at rest.
    std::shared_ptr<const void> owner;
};

// An infinite plane.
struct ShapePlane {
    std::array<double, 3> normal = {0, 1, 0};  // unit length, out of the shape
    double offset = 0;                         // m; its points have normal · x = offset
};

// All shapes of a frame, and the settings of its `:picture` nodes. Copies are cheap (a shared pointer); it is read,
// copied and released from any thread.
class SceneShapes {
public:
    SceneShapes();  // none

    // Both are in the order of the nodes; infinite shapes other than planes are omitted.
    std::vector<ShapeMesh> meshes() const;
    std::vector<ShapePlane> planes() const;
    // Returns true if the scene sets the camera of its pictures.
    bool has_camera() const;
    // Returns the warnings of making them, such as a mesh with holes.
    std::vector<std::string> warnings() const;

    // Returns true if they are the same: of one frame, or of two frames of a scene in which nothing moves.
    bool operator==(const SceneShapes& other) const;

private:
    friend class Scene;
    friend class SceneFrame;
    friend class SceneFilm;
    friend struct SceneInside;  // of Rapid itself
    struct Data;
    explicit SceneShapes(std::shared_ptr<const Data> data);
    std::shared_ptr<const Data> data_;  // null: none
};

}  // namespace rapid
