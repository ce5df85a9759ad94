-- group_by_shape: points near a torus light up as they drift through it.
--
-- Shows:  :group_by_shape; the picture is frame 48.
-- Proves: tests/lua/nodes/test_group_by_shape.lua has its closed form.
-- Run:    rapid run graphs/nodes/group_by_shape.lua -f 48 --size 288x162 -o /tmp/group_by_shape.png
local rapid = require "rapid"

local ring = rapid.levelset.torus { radius = 0.7, tube = 0.2, voxel = 0.03 }

return rapid.create { fps = 24, seed = 3,
    points = rapid.points.grid { size = {2, 0.9, 2}, spacing = 0.06 } }
  :attribute      { Cd = {0.2, 0.25, 0.35}, pscale = 0.01 }
  :group_by_shape { into = "near", shape = ring, distance = 0.02 }
  :points         { name = "dark", kernel = function(p) p.Cd = vec3(0.2, 0.25, 0.35) end }
  :points         { name = "light", group = "near", kernel = function(p) p.Cd = vec3(0.3, 1, 0.6) end }
  :points         ("drift", function(p) p.v = rapid.math.curl_noise(p.P) * 0.2 end)
  :solve          {}
