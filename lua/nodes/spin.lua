-- spin: turns the `orient` of points about an axis, each at a rate of its own.
--
--   orient = rotation(axis, rate (1 + variation r) dt) orient            r: the point's own number in [-1, 1]
local rapid = require "rapid"

return rapid.node {
  name = "spin",
  doc  = "Turns orient about a fixed axis.",
  params = {
    axis      = { "vec3", default = {0, 1, 0}, doc = "axis in world space, of any nonzero length" },
    rate      = { "float", default = 360, unit = "deg/s", doc = "angular speed" },
    variation = { "float", default = 0, min = 0,
                  doc = "maximum random deviation of a point's rate, as a fraction of it" },
  },
  makes = { orient = {0, 0, 0, 1} },
  points = function(p, _, params)
    local rate = params.rate * (1 + params.variation * (2 * p:rand(1) - 1))
    p.orient = (rapid.math.rotation(params.axis, rate * p.dt) * p.orient):normalized()
  end,
}
