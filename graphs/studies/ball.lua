-- ball: a ball dropped from 2 m, compared with the parabolas between its bounces.
--
-- Shows:  the three methods of :collide. "continuous" finds the contact at its time, on the parabola, and is exact at
--         one sub-step; "backtrack" and "project" (the paper's §4.2 and §4.1) look after each step, and converge.
-- Proves: continuous is exact, and the others are worse at any number of sub-steps (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/ball.lua -o /tmp/ball
local rapid = require "rapid"

local g, top, bounce = 9.81, 2, 0.7

-- Sums the flights, each with `bounce` times the speed of the one before, until they take no time.
local function height(time)
  local landing = math.sqrt(2 * top / g)
  if time <= landing then return top - g * time ^ 2 / 2 end
  local speed, begun = g * landing * bounce, landing
  while speed > 1e-6 do
    local flight = 2 * speed / g
    if time <= begun + flight then return speed * (time - begun) - g * (time - begun) ^ 2 / 2 end
    begun, speed = begun + flight, speed * bounce
  end
  return 0
end

return rapid.study {
  name   = "bouncing ball",
  scene  = function(k)
    return rapid.create { points = rapid.points.from { P = {{0, top, 0}} } }
      :gravity { g = {0, -g, 0} }
      :collide { shape = rapid.shape.plane { normal = {0, 1, 0} }, bounce = bounce, method = k.method }
      :solve { substeps = k.substeps }
  end,
  frames = {1, 49},
  sweep  = { method = {"project", "backtrack", "continuous"}, substeps = {1, 2, 4, 8, 16, 32} },
  lines  = "method",
  reference = function(frame) return { P = {{0, height(frame.time), 0}} } end,
}
