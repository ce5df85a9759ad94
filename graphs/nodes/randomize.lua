-- randomize: a bed of gravel with few large stones and many small ones.
--
-- Shows:  :randomize; the picture is frame 3.
-- Proves: tests/lua/nodes/test_randomize.lua has its closed form.
-- Run:    rapid run graphs/nodes/randomize.lua -f 3 --size 288x162 -o /tmp/randomize.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit      { source = rapid.mesh.grid { size = {2.4, 1.6} }, impulse = {[2] = 9000}, speed = 0,
               attributes = { Cd = {0.75, 0.7, 0.62} } }
  :randomize { attribute = "pscale", min = 0.004, max = 0.05, bias = 4 }
  :solve     {}
