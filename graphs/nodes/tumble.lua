-- tumble: leaves fall, each turning with its own angular velocity, bright where the light hits them.
--
-- Shows:  :tumble; the picture is frame 30.
-- Proves: tests/lua/nodes/test_tumble.lua has its closed form.
-- Run:    rapid run graphs/nodes/tumble.lua -f 30 --size 288x162 -o /tmp/tumble.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit   { source = rapid.mesh.grid { size = {3, 1.2}, center = {0, 1.6, 0} }, rate = 4500, velocity = {0, -0.6, 0},
            spread = 15, attributes = { w = { {-6, -1, -4}, {6, 1, 4} }, Cd = {1, 1, 1}, pscale = 0.014 } }
  :tumble { drag = 0.3 }
  :points ("shade", function(p)
      local lit = math.abs(p.orient:rotate(vec3(0, 1, 0)):dot(vec3(0.48, 0.8, 0.36)))
      p.Cd = vec3(0.2, 0.08, 0.02):lerp(vec3(1, 0.65, 0.2), lit)
    end)
  :solve  {}
