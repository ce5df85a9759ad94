-- lift: embers rise by their heat, cool, and sink again.
--
-- Shows:  :lift; the picture is frame 60.
-- Proves: tests/lua/nodes/test_lift.lua has its closed form.
-- Run:    rapid run graphs/nodes/lift.lua -f 60 --size 288x162 -o /tmp/lift.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit    { source = rapid.mesh.sphere { radius = 0.2 }, rate = 7000, velocity = {0.5, 0.5, 0}, spread = 25, life = 2,
             attributes = { heat = 1, Cd = {1, 1, 1}, pscale = 0.008 } }
  :lift    { strength = 9, cooling = 0.5 }
  :gravity { g = {0, -2, 0} }
  :points  ("glow", function(p) p.Cd = vec3(0.5, 0.08, 0.03):lerp(vec3(1, 0.85, 0.5), p.heat) end)
  :solve   {}
