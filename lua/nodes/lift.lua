-- lift: hot points rise and cool; cold ones fall like the rest.
--
--   a = strength heat up            (m/s²)
--   heat' = -heat / cooling         solved over the frame, so no frame rate is too low for it
local rapid = require "rapid"

return rapid.node {
  name = "lift",
  doc  = "Raises points in proportion to their heat and cools them.",
  params = {
    strength = { "float", default = 1, min = 0, unit = "m/s²", doc = "acceleration at a heat of 1" },
    cooling  = { "float", default = 0.5, min = 1e-3, unit = "s", doc = "time in which the heat falls to 1/e" },
  },
  points = function(p, _, params)
    p.v = p.v + vec3(0, params.strength * p.heat * p.dt, 0)
    p.heat = p.heat * math.exp(-p.dt / params.cooling)
    if p.heat < 0.01 then p:join "cold" end
  end,
}
