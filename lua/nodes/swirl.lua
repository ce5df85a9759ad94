-- swirl: a wind about an axis that grows with the distance from it.
--
--   v' = strength n x (P - center)            n = axis / |axis|
local rapid = require "rapid"

return rapid.node {
  name = "swirl",
  doc  = "Accelerates points around an axis in proportion to their distance from it.",
  params = {
    axis     = { "vec3", default = {0, 1, 0}, doc = "axis of rotation, of any nonzero length" },
    center   = { "vec3", default = {0, 0, 0}, unit = "m", doc = "position on the axis" },
    strength = { "float", default = 1, unit = "1/s²", doc = "acceleration per metre of distance from the axis" },
  },
  points = function(p, _, params)
    local n = params.axis:normalized()
    p.v = p.v + n:cross(p.P - params.center) * (params.strength * p.dt)
  end,
}
