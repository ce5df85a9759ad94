-- align: turns the `orient` of points along the shortest arc until one of their axes points along an attribute.
--
--   the angle between the two falls as e^(-t / response); immediately if response is 0
--
-- A point whose attribute is zero keeps its orientation.
local rapid = require "rapid"

return rapid.node {
  name = "align",
  doc  = "Turns orient so that an axis points along an attribute.",
  params = {
    to       = { "read", default = "N", doc = "a vec3: where the axis is to point" },
    axis     = { "vec3", default = {0, 1, 0}, doc = "of the point, any length but zero" },
    response = { "float", default = 0, min = 0, unit = "s", doc = "time in which the angle falls to 1/e" },
  },
  makes = { orient = {0, 0, 0, 1} },
  points = function(p, _, params)
    local to = p[params.to]
    local length = to:length()
    if length == 0 then return end
    local now = p.orient:rotate(params.axis:normalized())
    local turned = rapid.math.rotation_between(now, to / length) * p.orient
    if params.response > 0 then turned = p.orient:slerp(turned, 1 - math.exp(-p.dt / params.response)) end
    p.orient = turned:normalized()
  end,
}
