-- column: a column of grain collapses, spreads over the floor and comes to rest as a heap.
--
-- Shows:  :contact with friction, one of Rapid's constraints; the effect of sub-steps and iterations.
-- Proves: no grain overlaps another by more than a tenth of its radius at the end, at most one in a thousand still
--         tumbles, and more friction makes a steeper heap (tests/graphs/test_column.lua).
-- Run:    rapid run graphs/column.lua -f 1-72 -o /tmp/column.####.png
local rapid = require "rapid"

local friction = rapid.param("friction", 0.3, "Coulomb's coefficient, of grain on grain and on the floor")
local substeps = rapid.param("substeps", 12, "steps a frame")

local r = 0.02

local grain = rapid.points.grid { size = {0.52, 1.56, 0.52}, spacing = 2.6 * r, center = {0, 0.8, 0} }

return rapid.create { fps = 24, points = grain, seed = 3 }
  :attribute { pscale = r, Cd = {0.85, 0.65, 0.4} }
  -- Scatters the grains: spheres stacked in line, which do not turn here, would stand like a crystal.
  :points  ("scatter", function(p, frame)
      if frame.number == 2 then
        p.P = p.P + (vec3(p:rand(1), p:rand(2), p:rand(4)) - vec3(0.5, 0.5, 0.5)) * r
        p.Cd = vec3(0.85, 0.65, 0.4) * (0.6 + 0.4 * p:rand(3))
      end
    end)
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0, friction = friction }
  :contact { friction = friction }
  -- Friction needs more than one iteration to hold a slope: with one the heap is 4 degrees flatter.
  :solve   { substeps = substeps, iterations = 4 }
