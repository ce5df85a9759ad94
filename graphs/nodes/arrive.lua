-- arrive: sparks shoot up and gather at a place.
--
-- Shows:  :arrive; the picture is frame 48.
-- Proves: tests/lua/nodes/test_arrive.lua has its closed form.
-- Run:    rapid run graphs/nodes/arrive.lua -f 48 --size 288x162 -o /tmp/arrive.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit   { source = rapid.mesh.grid { size = {0.1, 0.1} }, rate = 7000, velocity = {0, 3, 0}, spread = 50, life = 1.6,
            attributes = { Cd = {1, 0.8, 0.5}, pscale = 0.007 } }
  :arrive { target = {1.6, 0.4, 0}, speed = 1.8, radius = 0.8, response = 0.35 }
  :solve  {}
