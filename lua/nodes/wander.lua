-- wander: drags points along a turbulent flow that neither gathers nor spreads them.
--
--   v' = (u - v) / response            u = speed curl_noise(P / size, change time), solved over the frame with u held
local rapid = require "rapid"

return rapid.node {
  name = "wander",
  doc  = "Carries points along a turbulent flow.",
  params = {
    speed    = { "float", default = 1, min = 0, unit = "m/s", doc = "root mean square speed of the flow" },
    size     = { "float", default = 1, min = 1e-6, unit = "m", doc = "size of the largest eddies" },
    change   = { "float", default = 0.5, min = 0, unit = "1/s", doc = "rate at which the flow changes" },
    octaves  = { "int", default = 2, min = 1, max = 16, doc = "number of eddy sizes, each half the previous one" },
    response = { "float", default = 0.2, min = 1e-6, unit = "s",
                 doc = "time in which the difference of the velocity falls to 1/e" },
    seed     = { "int", default = 0, min = 0, doc = "seed of the flow" },
  },
  points = function(p, frame, params)
    local flow = rapid.math.curl_noise(p.P / params.size, frame.time * params.change, params.octaves, params.seed)
    p.v = (flow * params.speed):lerp(p.v, math.exp(-p.dt / params.response))
  end,
}
