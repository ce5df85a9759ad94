-- jitter: kicks in random directions, new ones at each frame.
--
--   v += strength sqrt(dt) k            k: each component uniform in [-1, 1], so that |k|² is 1 on average
--
-- Independent kicks add up as the root of their number: with the root of dt, points scatter alike at any frame rate.
local rapid = require "rapid"

return rapid.node {
  name = "jitter",
  doc  = "Kicks points in random directions, in each frame.",
  params = {
    strength = { "float", default = 1, min = 0, unit = "m/s", doc = "root mean square speed gained in one second" },
  },
  points = function(p, frame, params)
    local k = vec3(2 * p:rand(1, frame) - 1, 2 * p:rand(2, frame) - 1, 2 * p:rand(3, frame) - 1)
    p.v = p.v + k * (params.strength * math.sqrt(p.dt))
  end,
}
