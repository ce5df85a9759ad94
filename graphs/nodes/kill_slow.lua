-- kill_slow: debris rolls out on the floor and vanishes where it comes to rest.
--
-- Shows:  :kill_slow; the picture is frame 40.
-- Proves: tests/lua/nodes/test_kill_slow.lua has its closed form.
-- Run:    rapid run graphs/nodes/kill_slow.lua -f 40 --size 288x162 -o /tmp/kill_slow.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit      { source = rapid.mesh.box { size = {0.3, 0.3, 0.3}, center = {0, 1, 0} }, rate = 9000,
               velocity = {3, 1, 0}, spread = 30, attributes = { Cd = {0.8, 0.7, 0.55}, pscale = 0.008 } }
  :gravity   {}
  :collide   { shape = rapid.shape.plane {}, bounce = 0.2, friction = 0.4 }
  :kill_slow { speed = 0.3, age = 0.2 }
  :solve     {}
