// Scenes opened from strings; a test fails if they have errors.
#pragma once

#include <string>
#include <utility>

#include "include/rapid/scene.h"
#include "tests/test.h"

namespace rapid::test {

template <class T>
T good(Result<T> result)
{
    if (!result) FAIL(result.error().text());
    return std::move(*result);
}

// A scene whose second frame has every figure of runtime/solver/figure_table.h: sand of more points than the error
// since birth is estimated for, with a pair that breaks at once; drops on a level set; a rod that pins stretch; a point
// between two planes that leave no room.
inline constexpr char every_figure[] = R"(
local rapid = require "rapid"
local function grid(spacing, height)
  return rapid.points.grid { size = {1, 1, 1}, spacing = spacing, center = vec3(0, height, 0) }
end
local sand = rapid.create { points = grid(0.09, 2) } :attribute { pscale = 0.02 } :gravity {} :contact {}
  :distance { pairs = {{1, 2}}, rest = 0.01, compliance = 1e-3, strain = 0.1 } :solve {}
local drops = rapid.create { points = grid(0.25, 0) }
  :emit { source = rapid.mesh.sphere { radius = 0.1, center = {0, 0.6, 0} }, rate = 2400, speed = 6,
          life = {0.02, 0.06} }
  :gravity {} :collide { shape = rapid.levelset.sphere { radius = 0.4, voxel = 0.05 } } :solve {}
local held = rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}} } } :attribute { pscale = 0.1 }
  :distance { pairs = {{1, 2}}, rest = 0.5 } :pin {} :solve {}
local pressed = rapid.create { points = rapid.points.from { P = {{0, 0.05, 0}} } }
  :attribute { pscale = 0.1 } :gravity {}
  :collide { shape = rapid.shape.plane {} }
  :collide { shape = rapid.shape.plane { offset = -0.1, normal = {0, -1, 0} } } :solve {}
return { main = drops, sand = sand, held = held, pressed = pressed }
)";

inline Scene opened(const std::string& text, SceneOptions options = {}, const std::string& name = "cloud.lua")
{
    return good(Scene::open_text(name, text, std::move(options)));
}

}  // namespace rapid::test
