-- nearest_place: dust comes down on a torus that turns, each grain where the surface is nearest, and stays with it.
--
-- Shows:  :nearest_place; the picture is frame 44.
-- Proves: tests/lua/nodes/test_nearest_place.lua has its closed form.
-- Run:    rapid run graphs/nodes/nearest_place.lua -f 44 --size 288x162 -o /tmp/nearest_place.png
local rapid = require "rapid"

local ring = rapid.mesh.torus { radius = 0.6, tube = 0.2, divisions = 48 }
  :transform { [1] = rapid.rotate({1, 0, 0.3}, 0), [49] = rapid.rotate({1, 0, 0.3}, 160) }

return rapid.create { fps = 24, seed = 3 }
  :emit          { source = rapid.shape.box { size = {2.6, 1.4, 1.4} }, from = "volume", impulse = { [1] = 7000 },
                   attributes = { Cd = {0.4, 0.7, 1}, pscale = 0.008 } }
  :nearest_place { shape = ring }
  :points        ("come", function(p, frame)
      local left = 0.4 + 1.1 * p:rand(1) - frame.time
      p.v = left > 0 and (p.goal - p.P) * math.min(2 / left, 1 / p.dt) or (p.goal - p.P) / p.dt
      p.Cd = vec3(1, 0.6, 0.25):lerp(vec3(0.4, 0.7, 1), math.min(5 * (p.goal - p.P):length(), 1))
    end)
  :solve         {}
