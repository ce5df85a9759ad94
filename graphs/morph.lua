-- morph: a ball of points becomes a knot.
--
-- Shows:  :goal to a mesh, each point at its own time, and a node before it that leads points astray.
-- Proves: at 3.5 s each point rests at its own place on the knot (tests/graphs/test_morph.lua).
-- Run:    rapid run graphs/morph.lua -f 1-108 -o /tmp/morph.mp4
local rapid = require "rapid"

local count = rapid.param("count", 12000, "points")

-- A tube of radius 0.16 m along the trefoil knot.
local rows, sides = 160, 12
local function curve(k)
  local t = 2 * math.pi * k / rows
  local ring = 2 + math.cos(3 * t)
  return vec3(ring * math.cos(2 * t), 3 + 1.1 * math.sin(3 * t), ring * math.sin(2 * t)) * 0.36
end
local points, faces = {}, {}
for k = 0, rows - 1 do
  local along = (curve(k + 1) - curve(k - 1)):normalized()
  local u = along:cross(vec3(0, 1, 0)):normalized()
  local w = u:cross(along)
  for j = 0, sides - 1 do
    local angle = 2 * math.pi * j / sides
    points[#points + 1] = curve(k) + (u * math.cos(angle) + w * math.sin(angle)) * 0.16
    local next, up = (k + 1) % rows * sides, (j + 1) % sides
    faces[#faces + 1] = {k * sides + j + 1, next + j + 1, next + up + 1, k * sides + up + 1}
  end
end

return rapid.create { fps = 24, seed = 9 }
  :emit    { source = rapid.shape.sphere { radius = 0.7, center = {0, 1.08, 0} }, impulse = { [1] = count },
             attributes = { Cd = {1, 1, 1}, pscale = 0.015 } }
  :wander  { speed = 0.5, size = 0.6, response = 0.3 }
  :goal    { to = rapid.mesh.from { points = points, faces = faces }, by = "random",
             start = 1, time = 1.5, stagger = 1 }
  :points  ("colour", function(p)
      local way = (p.goal - p.P):length()
      p.Cd = vec3(1, 0.55, 0.15):lerp(vec3(0.15, 0.5, 1), rapid.math.smoothstep(0, 0.8, way))
    end)
  :solve   {}
  :picture { emitters = false, camera = rapid.camera { position = {0, 2.6, 4}, target = {0, 1.08, 0} } }
