-- impacts: balls that hit others at rest, obliquely; the error is in the positions of all of them afterwards.
--
-- Shows:  impacts at their times within a sub-step. If forces are constant in it they are exact; if forces depend on
--         position, an impact is of order 2. If they depend on velocity it is of order 1, as the force after an impact
--         is that of the velocity before.
-- Proves: both orders (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/impacts.lua -o /tmp/impacts
local rapid = require "rapid"

local count, r = 40, 0.1 -- pairs; m

local function balls()
  local P, v = {}, {}
  local function ball(x, y, z, speed) P[#P + 1], v[#v + 1] = {x, y, z}, {speed, 0, 0} end
  for i = 1, count do
    ball(-0.25 - 0.2 * ((i * 0.414214) % 1), 1.2 * r * ((i * 0.618034) % 1), i, 4)
    ball(0, 0, i, 0)
  end
  return rapid.points.from { P = P, v = v }
end

return rapid.study {
  name   = "impacts",
  scene  = function(k)
    local chain = rapid.create { fps = 24, points = balls() }
    if k.force == "drag" then
      chain = chain:drag { quadratic = 2 }
    else
      chain = chain:turbulence { amplitude = 10, size = 0.7, speed = 0 }
    end
    return chain
      :contact { radius = r, bounce = 0.8, friction = 0.2 }
      :solve   { substeps = k.substeps, sleep = math.huge }
  end,
  frames = {1, 6},
  sweep  = { force = {"drag", "turbulence"}, substeps = {2, 4, 8, 16, 32} },
  lines  = "force",
  reference = { substeps = 4096 },
}
