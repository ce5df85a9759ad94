-- snow: snow settles on a fir, and comes down in a cloud when the fir is shaken. It begins two seconds before frame 1.
--
-- Shows:  response = "stick" with an adhesion on a moving body; meshes made in the scene.
-- Proves: flakes stay where they landed until the fir's motion exceeds their adhesion
--         (tests/graphs/test_snow.lua).
-- Run:    rapid run graphs/snow.lua -f 1-132 -o /tmp/snow.mp4
local rapid = require "rapid"

local rate = rapid.param("rate", 7000, "flakes per second, until frame 39")
local adhesion = rapid.param("adhesion", 22, "m/s² that take a flake off")

-- A cone whose edge is cut into branches.
local function tier(radius, low, high)
  local points, faces = {{0, high, 0}, {0, low + 0.08, 0}}, {}
  for k = 0, 63 do
    local angle = 2 * math.pi * k / 64
    local r = radius * (0.86 + 0.14 * math.cos(9 * angle + 7 * low))
    points[k + 3] = {r * math.cos(angle), low, r * math.sin(angle)}
    faces[2 * k + 1] = {1, (k + 1) % 64 + 3, k + 3}
    faces[2 * k + 2] = {2, k + 3, (k + 1) % 64 + 3}
  end
  return rapid.levelset.from_mesh(rapid.mesh.from { points = points, faces = faces }, { voxel = 0.025 })
end
local fir = rapid.levelset.box { size = {0.14, 0.5, 0.14}, center = {0, 0.22, 0}, voxel = 0.025 }
for k = 0, 4 do fir = fir:union(tier(0.85 - 0.15 * k, 0.35 + 0.36 * k, 0.95 + 0.37 * k)) end

-- The fir is still until frame 82; then it is shaken for a second.
local function shaken(frame)
  local t = rapid.math.clamp(frame.time - 5.4, 0, 1)
  return rapid.rotate({0.3, 0, 1}, 5 * math.sin(math.pi * t) * math.sin(2 * math.pi * 5 * t))
end

return rapid.create { fps = 24, seed = 12, start = -47 }
  :emit       { source = rapid.mesh.grid { size = {5, 3.6}, center = {0, 2.9, 0} },
                rate = function(frame) return frame.time < 3.6 and rate or rate / 30 end,
                birth = function(p) p.P = vec3(p.P.x * p:rand(1) ^ 0.5 - 0.15, p.P.y, p.P.z * p:rand(2) ^ 0.5) end,
                velocity = {0, -1.2, 0}, spread = 20, attributes = { pscale = {0.006, 0.013}, Cd = {0.95, 0.97, 1} } }
  :gravity    {}
  :wind       { velocity = {0.15, 0, 0}, drag = 7 }
  :turbulence { amplitude = 3, size = 0.5, speed = 0.4 }
  :collide    { shape = fir, transform = shaken, response = "stick", adhesion = adhesion }
  :collide    { shape = rapid.shape.plane {}, response = "stick" }
  :solve      { substeps = 3 }
  :picture    { emitters = false, camera = rapid.camera { position = {1, 1.7, 4.6}, target = {0, 1.1, 0} } }
