// The shapes of a scene in a frame, for renderers and viewers: what its points collide with, and what they are born
// from.
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

// What a shape is to the points.
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
    // Of the arrays, which it keeps valid and unchanged. Meshes of two frames that have one owner are the same mesh, as
    // of a shape that rests.
    std::shared_ptr<const void> owner;
};

// An infinite plane.
struct ShapePlane {
    std::array<double, 3> normal = {0, 1, 0};  // of length 1, out of the shape
    double offset = 0;                         // m; its points have normal · x = offset
};

// All shapes of a frame, and what its `:picture` nodes say. Copying one copies a pointer; it is read, copied and
// released from any thread.
class SceneShapes {
public:
    SceneShapes();  // none

    // In the order of the nodes; infinite shapes other than planes are in neither.
    std::vector<ShapeMesh> meshes() const;
    std::vector<ShapePlane> planes() const;
    // Whether the scene says from where its pictures are seen; SceneFrame::camera() has the camera.
    bool has_camera() const;
    // What was warned of when they were made, such as a mesh with holes.
    std::vector<std::string> warnings() const;

    // Whether they are the same ones: of one frame, or of two frames of a scene in which nothing moves.
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
