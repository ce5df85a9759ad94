-- orbit: a thousand points on a circle about an attracting centre, compared with the circle itself.
--
-- Shows:  a force that is integrated in steps: :attract, of second order. Doubling the sub-steps quarters the error.
-- Proves: the order is 2 (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/orbit.lua -o /tmp/orbit
local rapid = require "rapid"

local count, radius, strength = 1000, 1, 4
local speed = math.sqrt(strength / radius) -- the attraction strength / radius² then bends the path into the circle
local omega = speed / radius

-- Returns the points' state at a time: they are evenly spread on the circle, and turn about y.
local function on_circle(time)
  local P, v = {}, {}
  for i = 1, count do
    local angle = 2 * math.pi * i / count + omega * time
    P[i] = {radius * math.cos(angle), 0, -radius * math.sin(angle)}
    v[i] = {-speed * math.sin(angle), 0, -speed * math.cos(angle)}
  end
  return { P = P, v = v }
end

return rapid.study {
  name   = "orbit",
  scene  = function(k)
    return rapid.create { points = rapid.points.from(on_circle(0)) }
      :attract { strength = strength, falloff = 2 }
      :solve { substeps = k.substeps }
  end,
  frames = {1, 49},
  sweep  = { substeps = {1, 2, 4, 8, 16} },
  reference = function(frame) return on_circle(frame.time) end,
}
