-- avoid: a stream parts before a ball that it never touches.
--
-- Shows:  :avoid; the picture is frame 60.
-- Proves: tests/lua/nodes/test_avoid.lua has its closed form.
-- Run:    rapid run graphs/nodes/avoid.lua -f 60 --size 288x162 -o /tmp/avoid.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit  { source = rapid.mesh.grid { size = {0.02, 1.2}, center = {-1.5, 0, 0} }, rate = 9000, velocity = {1.6, 0, 0},
           life = 2.2, attributes = { Cd = {0.35, 0.8, 0.9}, pscale = 0.007 } }
  :avoid { shape = rapid.shape.sphere { radius = 0.3 }, distance = 0.5, strength = 14 }
  :points("part", function(p) p.v = p.v + vec3(0, 0.12 * (p:rand(1) - 0.5) * p.dt, 0) end)
  :solve {}
