-- interact: pairs that come near and are driven apart, compared with the oscillator that each pair is.
--
-- Shows:  neighbours found at every sub-step. With w = 1 - d / radius the separation of two points is a spring with the
--         rest length `radius`: d'' = 2 separation (1 - d / radius).
-- Proves: the order by sub-steps is 2 (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/interact.lua -o /tmp/interact
local rapid = require "rapid"

local pairs_along, spacing = 10, 10 -- in x and z; m, many radii
local radius, separation = 1, 40 -- m, m/s²
local omega = math.sqrt(2 * separation / radius)

-- Returns the distance within a pair that is 0.9 m at first and closes at `speed`.
local function distance(speed, time)
  return radius - 0.1 * math.cos(omega * time) - speed / omega * math.sin(omega * time)
end
local function opening(speed, time)
  return 0.1 * omega * math.sin(omega * time) - speed * math.cos(omega * time)
end

local function state(time)
  local P, v = {}, {}
  for i = 0, pairs_along - 1 do
    for k = 0, pairs_along - 1 do
      local speed = 1 + 4 * (pairs_along * i + k) / pairs_along ^ 2
      local half, half_v = distance(speed, time) / 2, opening(speed, time) / 2
      for side = -1, 1, 2 do
        P[#P + 1] = {spacing * i + side * half, 0, spacing * k}
        v[#v + 1] = {side * half_v, 0, 0}
      end
    end
  end
  return { P = P, v = v }
end

return rapid.study {
  name   = "interact",
  scene  = function(k)
    return rapid.create { points = rapid.points.from(state(0)) }
      :interact { radius = radius, separation = separation }
      :solve { substeps = k.substeps }
  end,
  frames = {1, 6}, -- within half a period, so that they stay within the radius
  sweep  = { substeps = {2, 4, 8, 16, 32} },
  reference = function(frame) return state(frame.time) end,
}
