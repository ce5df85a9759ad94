-- impact_spin: pebbles hit a slope and spin from then on; those that only fall are dark.
--
-- Shows:  :impact_spin; the picture is frame 40.
-- Proves: tests/lua/nodes/test_impact_spin.lua: a point that has hit turns as if it rolled.
-- Run:    rapid run graphs/nodes/impact_spin.lua -f 40 --size 288x162 -o /tmp/impact_spin.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit        { source = rapid.mesh.grid { size = {0.5, 1.6}, center = {-1, 1.4, 0} }, rate = 5000,
                 attributes = { Cd = {0.3, 0.3, 0.35}, pscale = 0.012 } }
  :gravity     {}
  :impact_spin { grip = 0.8 }
  :points      ("show", function(p)
      p.Cd = vec3(0.2, 0.2, 0.25):lerp(vec3(1, 0.6, 0.2), math.min(p.w:length() / 150, 1))
    end)
  :collide     { shape = rapid.shape.plane { normal = {0.4, 1, 0} }, bounce = 0.4, friction = 0.1, record = true }
  :solve       {}
