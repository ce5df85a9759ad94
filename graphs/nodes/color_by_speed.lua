-- color_by_speed: a fountain is white where it is fast, and blue at the top.
--
-- Shows:  :color_by_speed; the picture is frame 60.
-- Proves: tests/lua/nodes/test_color_by_speed.lua has its closed form.
-- Run:    rapid run graphs/nodes/color_by_speed.lua -f 60 --size 288x162 -o /tmp/color_by_speed.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit           { source = rapid.mesh.sphere { radius = 0.05 }, rate = 9000, velocity = {0, 5, 0}, spread = 14,
                    life = 1.2, attributes = { pscale = 0.008 } }
  :gravity        {}
  :color_by_speed { slow = {0.05, 0.15, 0.8}, fast = {0.9, 0.97, 1}, low = 0.8, high = 5 }
  :solve          {}
