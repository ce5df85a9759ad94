-- clumps: a body rises out of a pile of wet sand, which tears into clumps (the paper's figure 7).
--
-- Shows:  :clump together with :contact: bonds between grains that have touched, which break; a moving collider.
-- Proves: sand whose bonds hold 40 N is carried higher than dry sand, and no grain is in the body; the number of grains
--         that 10 N carry is chance (tests/graphs/test_clumps.lua).
-- Run:    rapid run graphs/clumps.lua -f 1-96 -o /tmp/clumps.####.png
local rapid = require "rapid"

local strength = rapid.param("strength", 10, "pull that a bond bears, N; 0 for dry sand")

local r = 0.04

-- A torso and a head instead of the paper's character.
local body = rapid.levelset.sphere { radius = 0.3, voxel = 0.03 }
  :union(rapid.levelset.sphere { radius = 0.19, center = {0, 0.42, 0}, voxel = 0.03 })
  :smooth {}

-- The body rests below the floor until the sand lies still, then rises.
local function rising(frame)
  local t = math.min(math.max((frame.number - 25) / 48, 0), 1)
  return rapid.translate(0, -0.75 + 1.5 * t * t * (3 - 2 * t), 0)
end

return rapid.create { fps = 24, seed = 4,
    points = rapid.points.grid { size = {1.5, 0.4, 1.5}, spacing = 2.05 * r, center = {0, 0.2, 0} } }
  :attribute { pscale = r, mass = 0.1, Cd = {0.72, 0.55, 0.36} }
  :points  ("shake", function(p, frame)
      if frame.number == 2 then p.v = vec3(p:rand(1) - 0.5, p:rand(2), p:rand(3) - 0.5) * 1.2 end
    end)
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.8 }
  :collide { shape = body, transform = rising, bounce = 0, friction = 0.5 }
  :contact { friction = 0.6 }
  :clump   { strength = strength }
  :solve   { substeps = 10 }
