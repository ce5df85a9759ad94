-- swirl: a wind about an axis that grows with the distance from it.
--
--   v' = strength n x (P - center)            n = axis / |axis|
local rapid = require "rapid"

return rapid.node {
  name = "swirl",
  doc  = "Turns points about an axis.",
  params = {
    axis     = { "vec3", default = {0, 1, 0}, doc = "axis of rotation, any length but zero" },
    center   = { "vec3", default = {0, 0, 0}, unit = "m", doc = "a place on the axis" },
    strength = { "float", default = 1, unit = "1/s²", doc = "acceleration at 1 m from the axis" },
  },
  points = function(p, _, params)
    local n = params.axis:normalized()
    p.v = p.v + n:cross(p.P - params.center) * (params.strength * p.dt)
  end,
}
