-- wrap: a point that has left a box on one side comes back on the other, so that a storm of snow needs no sky.
--
--   P = min + (P - min) mod (max - min)
local rapid = require "rapid"

return rapid.node {
  name = "wrap",
  doc  = "Moves points that leave a box to its opposite side.",
  params = {
    min = { "vec3", default = {-1, -1, -1}, unit = "m", doc = "lower corner of the box" },
    max = { "vec3", default = {1, 1, 1}, unit = "m", doc = "upper corner of the box, above min on each axis" },
  },
  points = function(p, _, params)
    local min, size = params.min, params.max - params.min
    if not (size.x > 0 and size.y > 0 and size.z > 0) then
      error(("max = %s must be above min = %s on each axis"):format(tostring(params.max), tostring(min)))
    end
    local from = p.P - min
    p.P = min + vec3(from.x % size.x, from.y % size.y, from.z % size.z)
  end,
}
