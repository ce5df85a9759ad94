-- hourglass: sand runs through the neck of a funnel at a rate set by the neck, not by the height of the sand.
--
-- Shows:  :contact next to a curved level set; a heap that grows under the stream.
-- Proves: the same amount passes in each half second, however little is left above, and no sand is in the glass
--         (tests/graphs/test_hourglass.lua).
-- Run:    rapid run graphs/hourglass.lua -f 1-144 -o /tmp/hourglass.####.png
local rapid = require "rapid"

local neck = rapid.param("neck", 0.05, "radius of the neck, m")
local height = rapid.param("height", 0.35, "of the sand at first, m")

local r = 0.01
local tube = 0.3 -- radius of the glass's wall, m

-- The inner side of a torus is a funnel.
local funnel = rapid.levelset.torus { radius = tube + neck, tube = tube, voxel = 0.015, center = {0, 0.55, 0} }
local sand = rapid.points.grid { size = {0.3, height, 0.3}, spacing = 2.1 * r, center = {0, 0.86 + height / 2, 0} }

return rapid.create { fps = 24, points = sand, seed = 2 }
  :attribute { pscale = r, Cd = {0.95, 0.75, 0.45} }
  :points  ("shake", function(p, frame)
      if frame.number == 2 then p.v = vec3(p:rand(1) - 0.5, 0, p:rand(2) - 0.5) * 0.3 end
    end)
  :gravity {}
  :collide { shape = funnel, bounce = 0, friction = 0.2 }
  :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.5 }
  :contact { friction = 0.3 }
  :solve   { substeps = 10 }
