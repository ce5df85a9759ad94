-- color_by_speed: blends from one colour to another with the speed.
--
--   Cd = slow + (fast - slow) t            t = (|v| - low) / (high - low), clamped to [0, 1]
local rapid = require "rapid"

return rapid.node {
  name = "color_by_speed",
  doc  = "Blends the colour of points between two colours by their speed.",
  params = {
    slow = { "vec3", default = {0.1, 0.2, 0.9}, min = 0, doc = "linear RGB colour at the speed low and below" },
    fast = { "vec3", default = {1, 0.9, 0.6}, min = 0, doc = "linear RGB colour at the speed high and above" },
    low  = { "float", default = 0, min = 0, unit = "m/s", doc = "speed of the colour slow" },
    high = { "float", default = 5, min = 0, unit = "m/s", doc = "speed of the colour fast" },
  },
  makes = { Cd = {1, 1, 1} },
  points = function(p, _, params)
    p.Cd = params.slow:lerp(params.fast, rapid.math.fit(p.v:length(), params.low, params.high, 0, 1))
  end,
}
