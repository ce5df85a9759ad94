-- stiff: points on springs in thick air, from soft to a thousand times stiffer than a step can follow.
--
-- Shows:  no stiffness and no drag is too stiff. Spring and drag are solved together, exactly, at one sub-step a
--         frame, with omega dt from 0.4 to 4,000.
-- Proves: every row is exact to rounding (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/stiff.lua -o /tmp/stiff
local rapid = require "rapid"

local count = 1000
local damping = 0.1 -- fraction of the critical damping

-- Each point swings about 0 from its own position, starting at rest.
local function swung(time, omega)
  local P = {}
  local turning = omega * math.sqrt(1 - damping ^ 2)
  local x = math.exp(-damping * omega * time)
    * (math.cos(turning * time) + damping * omega / turning * math.sin(turning * time))
  for i = 1, count do P[i] = {i / count * x, 0, 0} end
  return { P = P }
end

return rapid.study {
  name   = "stiff springs in thick air",
  scene  = function(k)
    return rapid.create { points = rapid.points.from(swung(0, k.omega)) }
      :spring { stiffness = k.omega ^ 2 }
      :drag { linear = 2 * damping * k.omega }
      :solve { substeps = k.substeps }
  end,
  frames = {1, 25},
  sweep  = { omega = {10, 1000, 100000}, substeps = {1, 2, 4} },
  lines  = "omega",
  reference = function(frame, k) return swung(frame.time, k.omega) end,
}
