-- group_by_bounds: falling points burn while they are in a box, and only there.
--
-- Shows:  :group_by_bounds; the picture is frame 40.
-- Proves: tests/lua/nodes/test_group_by_bounds.lua has its closed form.
-- Run:    rapid run graphs/nodes/group_by_bounds.lua -f 40 --size 288x162 -o /tmp/group_by_bounds.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit            { source = rapid.mesh.grid { size = {2, 0.6} }, rate = 5000, velocity = {0, -0.5, 0},
                     attributes = { Cd = {0.3, 0.35, 0.45}, pscale = 0.008 } }
  :group_by_bounds { into = "inside", min = {-0.5, -1.1, -1}, max = {0.5, -0.5, 1} }
  :points          { name = "ash", kernel = function(p) p.Cd = vec3(0.3, 0.35, 0.45) end }
  :points          { name = "burn", group = "inside", kernel = function(p) p.Cd = vec3(1, 0.4, 0.05) end }
  :gravity         { g = {0, -0.8, 0} }
  :solve           {}
