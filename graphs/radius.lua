-- radius: beads on a ring, colliding by their centres and by their surfaces (figure 5 of the paper).
--
-- Left, radius = 0: a bead collides with its centre, and sinks in to its equator. Right, the attribute pscale: the bead
-- rests on the ring. The level set's band is as narrow as possible; Solve widens it as far as the beads need.
--
-- Shows:  pscale, the radius of collisions, and the bodies of points in a picture.
-- Proves: beads on the right touch the ring, and those on the left sink in by their radius
--         (tests/graphs/test_radius.lua).
-- Run:    rapid run graphs/radius.lua -f 1-72 --camera 1,1.9,4.2,1,0.35,0 -o /tmp/radius.####.png
local rapid = require "rapid"

local size = rapid.param("size", 0.1, "radius of the beads, metres")

local scene = rapid.create { fps = 24, seed = 3 }
for k, radius in ipairs { 0, rapid.attr "pscale" } do
  local x = 2 * (k - 1)
  local ring = rapid.levelset.torus { radius = 0.55, tube = 0.16, center = {x, 0.3, 0}, voxel = 0.03, half_width = 2 }
  local beads = {}
  for i = 1, 14 do
    local angle = 2 * math.pi * i / 14
    beads[i] = {x + 0.53 * math.cos(angle), 1 + 0.08 * (i % 3), 0.53 * math.sin(angle)}
  end
  scene = scene
    :emit    { source = rapid.points.from { P = beads }, impulse = { [2] = #beads },
               attributes = { pscale = size, Cd = k == 1 and {0.9, 0.4, 0.3} or {0.3, 0.6, 0.9} }, group = "side" .. k }
    :collide { group = "side" .. k, shape = ring, radius = radius, response = "stick" }
end
return scene:gravity {}:solve {}
