-- swirl: a column of smoke turns about its axis as it rises.
--
-- Shows:  :swirl; the picture is frame 48.
-- Proves: tests/lua/nodes/test_swirl.lua has its closed form.
-- Run:    rapid run graphs/nodes/swirl.lua -f 48 --size 288x162 -o /tmp/swirl.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit  { source = rapid.mesh.grid { size = {1.2, 1.2} }, rate = 8000, velocity = {0, 1.5, 0}, speed = 0,
           attributes = { Cd = {0.6, 0.75, 1}, pscale = 0.006 } }
  :swirl { axis = {0, 1, 0}, strength = 2.5 }
  :solve {}
