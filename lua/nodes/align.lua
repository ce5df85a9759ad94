-- align: turns the `orient` of points along the shortest arc until one of their axes points along an attribute.
--
--   the angle between the two falls as e^(-t / response); immediately if response is 0
--
-- A point whose attribute is zero keeps its orientation.
local rapid = require "rapid"

return rapid.node {
  name = "align",
  doc  = "Turns orient so that an axis of each point follows an attribute.",
  params = {
    to       = { "read", default = "N", doc = "vec3 attribute that gives the target direction" },
    axis     = { "vec3", default = {0, 1, 0}, doc = "axis of the point that is turned, of any nonzero length" },
    response = { "float", default = 0, min = 0, unit = "s",
                 doc = "time in which the angle falls to 1/e; 0 turns at once" },
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
