-- follow_curve: a ribbon of sparks runs along a curve.
--
-- Shows:  :follow_curve; the picture is frame 48.
-- Proves: tests/lua/nodes/test_follow_curve.lua has its closed form.
-- Run:    rapid run graphs/nodes/follow_curve.lua -f 48 --size 288x162 -o /tmp/follow_curve.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit         { source = rapid.mesh.torus { radius = 0.1, tube = 0.02 }, rate = 8000, speed = 0, life = 2,
                  attributes = { Cd = {1, 1, 1}, pscale = 0.006 } }
  :follow_curve { points = {{0, 0, 0}, {0.5, 0.8, 0}, {1.2, 0, 0.3}, {1.9, 0.8, 0}, {2.4, 0, 0}}, duration = 2 }
  :points       ("glow", function(p) p.Cd = vec3(1, 0.9, 0.6):lerp(vec3(0.6, 0.1, 0.3), p.age / 2) end)
  :solve        {}
