-- floor: a ball on a rising floor, compared with the parabolas between its bounces.
--
-- Shows:  a moving collider. The velocity relative to the floor bounces, at the time of the contact; "backtrack" and
--         "project" use the floor's position after the step.
-- Proves: continuous is exact; the others converge and are worse (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/floor.lua -o /tmp/floor
local rapid = require "rapid"

local g, top, rise, bounce = 9.81, 1, 0.8, 0.6

-- Returns the height in the floor's frame, in which the ball is thrown down at the floor's speed.
local function above_floor(time)
  local height, speed = top, -rise
  while true do
    local landing = (speed + math.sqrt(speed ^ 2 + 2 * g * height)) / g
    if time <= landing then return height + speed * time - g * time ^ 2 / 2 end
    time = time - landing
    height, speed = 0, bounce * math.abs(speed - g * landing)
    if speed < 1e-6 then return 0 end
  end
end

local function rising(frame) return rapid.translate(0, rise * frame.time, 0) end

return rapid.study {
  name   = "ball on a rising floor",
  scene  = function(k)
    return rapid.create { points = rapid.points.from { P = {{0, top, 0}} } }
      :gravity { g = {0, -g, 0} }
      :collide { shape = rapid.shape.plane {}, transform = rising, bounce = bounce, method = k.method }
      :solve { substeps = k.substeps }
  end,
  frames = {1, 49},
  sweep  = { method = {"project", "backtrack", "continuous"}, substeps = {1, 2, 4, 8, 16, 32} },
  lines  = "method",
  reference = function(frame) return { P = {{0, rise * frame.time + above_floor(frame.time), 0}} } end,
}
