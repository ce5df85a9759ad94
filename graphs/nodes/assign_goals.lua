-- assign_goals: a plane becomes a ball whose places are born for it.
--
-- Shows:  :assign_goals; the picture is frame 16.
-- Proves: tests/lua/nodes/test_assign_goals.lua: who gets which place.
-- Run:    rapid run graphs/nodes/assign_goals.lua -f 16 --size 288x162 -o /tmp/assign_goals.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit         { source = rapid.mesh.grid { size = {2, 2}, center = {0, -0.6, 0} }, impulse = { [1] = 8000 },
                  attributes = { place = 0, Cd = {0.5, 1, 0.6}, pscale = 0.01 } }
  :emit         { source = rapid.mesh.sphere { radius = 0.5, center = {0, 0.4, 0} }, impulse = { [1] = 8000 },
                  attributes = { place = 1 } }
  :group        { name = "places", where = function(p) return p.place == 1 end }
  :assign_goals { from = "places", by = "random" }
  :points       ("go", function(p) p.v = (p.goal - p.P) * (1 + 3 * p:rand(1)) end)
  :solve        {}
