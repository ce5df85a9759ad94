-- look_ahead: a stream parts before a ball that it sees coming.
--
-- Shows:  :look_ahead; the picture is frame 60.
-- Proves: tests/lua/nodes/test_look_ahead.lua: no contact, at the same speed.
-- Run:    rapid run graphs/nodes/look_ahead.lua -f 60 --size 288x162 -o /tmp/look_ahead.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit       { source = rapid.mesh.grid { size = {0.02, 1.2}, center = {-1.5, 0, 0} }, rate = 9000,
                velocity = {1.6, 0, 0}, life = 2.2, attributes = { Cd = {1, 0.7, 0.4}, pscale = 0.007 } }
  :look_ahead { shape = rapid.shape.sphere { radius = 0.3, center = {0.2, 0, 0} }, time = 0.8, clearance = 0.06 }
  :solve      {}
