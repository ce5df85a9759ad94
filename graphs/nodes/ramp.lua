-- ramp: a flame runs from white over yellow and red to soot.
--
-- Shows:  :ramp; the picture is frame 60.
-- Proves: tests/lua/nodes/test_ramp.lua has its closed form.
-- Run:    rapid run graphs/nodes/ramp.lua -f 60 --size 288x162 -o /tmp/ramp.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit   { source = rapid.mesh.sphere { radius = 0.15 }, rate = 9000, velocity = {0, 1.2, 0}, spread = 10, life = 1.6,
            attributes = { Cd = {1, 1, 1}, pscale = 0.008 } }
  :points ("rise", function(p, frame)
      p.v = p.v + (vec3(0, 1.2, 0) + rapid.math.curl_noise(p.P * 2.5, frame.time) * 1.5) * p.dt
    end)
  :ramp   { from = "age", to = "Cd",
            keys = {{0, {1, 0.95, 0.8}}, {0.4, {1, 0.65, 0.1}}, {0.9, {0.75, 0.12, 0.02}}, {1.5, {0.06, 0.06, 0.07}}} }
  :solve  {}
