-- align_to_velocity: darts point where they fly; their colour is the direction of their z axis.
--
-- Shows:  :align_to_velocity; the picture is frame 36.
-- Proves: tests/lua/nodes/test_align_to_velocity.lua has its closed form.
-- Run:    rapid run graphs/nodes/align_to_velocity.lua -f 36 --size 288x162 -o /tmp/align_to_velocity.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit              { source = rapid.mesh.sphere { radius = 0.05 }, rate = 8000, velocity = {0, 4.5, 0}, spread = 40,
                       life = 1.2, attributes = { Cd = {1, 1, 1}, pscale = 0.009 } }
  :gravity           {}
  :align_to_velocity {}
  :points            ("show", function(p) p.Cd = p.orient:rotate(vec3(0, 0, 1)) * 0.5 + vec3(0.5, 0.5, 0.5) end)
  :solve             {}
