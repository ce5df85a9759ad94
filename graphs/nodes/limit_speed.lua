-- limit_speed: a burst that a speed limit holds in a dome: no point is faster than 1.2 m/s.
--
-- Shows:  :limit_speed; the picture is frame 20.
-- Proves: tests/lua/nodes/test_limit_speed.lua has its closed form.
-- Run:    rapid run graphs/nodes/limit_speed.lua -f 20 --size 288x162 -o /tmp/limit_speed.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit        { source = rapid.mesh.sphere { radius = 0.05 }, impulse = {[2] = 9000}, velocity = {0, 3, 0},
                 spread = 70, attributes = { Cd = {1, 0.6, 0.2}, pscale = 0.006 } }
  :limit_speed { max = 1.2 }
  :solve       {}
