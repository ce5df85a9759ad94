-- limit_speed: clamps speeds between two bounds and keeps directions.
--
--   v = v / |v| clamp(|v|, min, max)            a point at rest has no direction, and stays at rest
local rapid = require "rapid"

return rapid.node {
  name = "limit_speed",
  doc  = "Keeps the speed of points within a range.",
  params = {
    min = { "float", default = 0, min = 0, unit = "m/s", doc = "minimum speed of a moving point" },
    max = { "float", default = math.huge, min = 0, max = math.huge, unit = "m/s", doc = "maximum speed" },
  },
  points = function(p, _, params)
    local speed = p.v:length()
    if speed > 0 then p.v = p.v * (rapid.math.clamp(speed, params.min, params.max) / speed) end
  end,
}
