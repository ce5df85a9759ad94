-- spin: a field of coins, each turning at its own rate, bright where it faces up.
--
-- Shows:  :spin; the picture is frame 30.
-- Proves: tests/lua/nodes/test_spin.lua has its closed form.
-- Run:    rapid run graphs/nodes/spin.lua -f 30 --size 288x162 -o /tmp/spin.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3, points = rapid.points.grid { size = {3, 0.05, 3}, spacing = 0.04 } }
  :attribute { Cd = {1, 1, 1}, pscale = 0.02 }
  :spin      { axis = {1, 0, 0.4}, rate = 120, variation = 0.3 }
  :points    ("show", function(p)
      local up = p.orient:rotate(vec3(0, 1, 0)).y
      p.Cd = vec3(0.25, 0.16, 0.05):lerp(vec3(1, 0.85, 0.4), 0.5 + 0.5 * up)
    end)
  :solve     {}
