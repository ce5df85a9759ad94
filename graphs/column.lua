-- column: a column of grain collapses, spreads over the floor and comes to rest as a heap.
--
-- Shows:  :contact with friction, one of Rapid's constraints; what sub-steps and iterations are for.
-- Proves: no grain overlaps another by more than a tenth of its radius at the end, none moves any more, and more
--         friction makes a steeper heap (tests/graphs/test_column.lua).
-- Run:    rapid run graphs/column.lua -f 1-72 -o /tmp/column.####.png
local rapid = require "rapid"

local friction = rapid.param("friction", 0.5, "Coulomb's coefficient, of grain on grain and on the floor")
local substeps = rapid.param("substeps", 12, "steps a frame")

local r = 0.02

-- A little out of line, so that it does not stand like a crystal.
local grain = rapid.points.grid { size = {0.42, 1.26, 0.42}, spacing = 2.1 * r, center = {0, 0.63, 0} }

return rapid.create { fps = 24, points = grain, seed = 3 }
  :attribute { pscale = r, Cd = {0.85, 0.65, 0.4} }
  :points  ("shake", function(p, frame)
      if frame.number == 2 then
        p.v = vec3(p:rand(1) - 0.5, 0, p:rand(2) - 0.5) * 0.4
        p.Cd = vec3(0.85, 0.65, 0.4) * (0.6 + 0.4 * p:rand(3))
      end
    end)
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0, friction = friction }
  :contact { friction = friction }
  -- Friction takes more than one iteration to hold a slope: with one the heap is 10 degrees flatter.
  :solve   { substeps = substeps, iterations = 4 }
