-- goal: a ball goes over into a ring, point by point.
--
-- Shows:  :goal; the picture is frame 30.
-- Proves: tests/lua/nodes/test_goal.lua has its closed form.
-- Run:    rapid run graphs/nodes/goal.lua -f 30 --size 288x162 -o /tmp/goal.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit   { source = rapid.mesh.sphere { radius = 0.4, center = {-1.2, 0, 0} }, impulse = { [1] = 9000 },
            attributes = { goal = {0, 0, 0}, Cd = {0.4, 0.8, 1}, pscale = 0.008 } }
  :points ("ring", function(p)
      local turn = 2 * math.pi * p:rand(1)
      p.goal = vec3(1.2, 0.5 * math.cos(turn), 0.5 * math.sin(turn))
    end)
  :goal   { time = 1, stagger = 0.7 }
  :points ("glow", function(p) p.Cd = vec3(0.4, 0.8, 1):lerp(vec3(1, 0.5, 0.2), (p.P.x + 1.6) / 2.8) end)
  :solve  {}
