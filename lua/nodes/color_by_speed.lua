-- color_by_speed: blends from one colour to another with the speed.
--
--   Cd = slow + (fast - slow) t            t = (|v| - low) / (high - low), clamped to [0, 1]
local rapid = require "rapid"

return rapid.node {
  name = "color_by_speed",
  doc  = "Colours points by their speed.",
  params = {
    slow = { "vec3", default = {0.1, 0.2, 0.9}, min = 0, doc = "colour at low and below, linear RGB" },
    fast = { "vec3", default = {1, 0.9, 0.6}, min = 0, doc = "colour at high and above, linear RGB" },
    low  = { "float", default = 0, min = 0, unit = "m/s", doc = "a speed" },
    high = { "float", default = 5, min = 0, unit = "m/s", doc = "another speed" },
  },
  makes = { Cd = {1, 1, 1} },
  points = function(p, _, params)
    p.Cd = params.slow:lerp(params.fast, rapid.math.fit(p.v:length(), params.low, params.high, 0, 1))
  end,
}
