-- wander: dust over a table is carried along by a turbulent flow.
--
-- Shows:  :wander; the picture is frame 72.
-- Proves: tests/lua/nodes/test_wander.lua has its closed form.
-- Run:    rapid run graphs/nodes/wander.lua -f 72 --size 288x162 -o /tmp/wander.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit   { source = rapid.mesh.grid { size = {0.4, 0.4} }, rate = 5000, velocity = {0.6, 0.5, 0},
            attributes = { Cd = {1, 0.75, 0.4}, pscale = 0.006 } }
  :wander { speed = 0.9, size = 0.8, octaves = 3, response = 0.7 }
  :solve  {}
