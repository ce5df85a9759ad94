-- collapse: a column of grain collapses along a wall; the error is the deepest overlap at the end of a frame.
--
-- Shows:  error = "residual": the violation of the constraints themselves, in metres, which needs no reference; and
--         sub-steps before iterations (Macklin et al. 2019): the same number of sweeps leaves less overlap as sub-steps
--         of one iteration each than as iterations in eight sub-steps.
-- Proves: sub-steps leave less overlap than the same number of iterations, from 32 on less than a third, from 64 on
--         less than a tenth, and less with each doubling (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/collapse.lua -o /tmp/collapse
local rapid = require "rapid"

local side, high, r = 6, 20, 0.02 -- grains; m
local step = 2.1 * r
local places = {}
for k = 0, side * side * high - 1 do
  local i, j, layer = k % side, math.floor(k / side) % side, math.floor(k / side / side)
  local off, across = 0.02 * ((k * 0.754878) % 1), 0.02 * ((k * 0.569840) % 1) -- or the column would stand
  places[k + 1] = {step * (i + 0.5 + off), step * (layer + 0.5), step * (j + 0.5 + across)}
end

local function wall(normal, offset)
  return { shape = rapid.shape.plane { normal = normal, offset = offset }, bounce = 0, friction = 0.3 }
end

return rapid.study {
  name   = "collapse",
  scene  = function(k)
    local by_substeps = k.sweeps_as == "sub-steps"
    return rapid.create { fps = 24, points = rapid.points.from { P = places } }
      :gravity {}
      :collide (wall({0, 1, 0}, 0))
      :collide (wall({1, 0, 0}, 0))
      :collide (wall({0, 0, 1}, 0))
      :collide (wall({0, 0, -1}, -step * side))
      :contact { radius = r, friction = 0.3 }
      :solve   { substeps = by_substeps and k.sweeps or 8, iterations = by_substeps and 1 or k.sweeps / 8,
                 sleep = math.huge } -- so that all points are in the timing
  end,
  frames = {1, 37},
  sweep  = { sweeps_as = {"sub-steps", "iterations"}, sweeps = {8, 16, 32, 64, 128} },
  lines  = "sweeps_as",
  error  = "residual",
}
