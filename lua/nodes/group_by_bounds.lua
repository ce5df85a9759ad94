-- group_by_bounds: puts the points in a box into a group, at each frame.
local rapid = require "rapid"

return rapid.node {
  name = "group_by_bounds",
  doc  = "Puts the points in a box into a group and removes all others from it.",
  params = {
    into = { "group", required = true, doc = "name of the group" },
    min  = { "vec3", default = {-1, -1, -1}, unit = "m", doc = "lower corner of the box; its faces are inside" },
    max  = { "vec3", default = {1, 1, 1}, unit = "m", doc = "upper corner of the box" },
  },
  points = function(p, _, params)
    local P, min, max = p.P, params.min, params.max
    if P.x >= min.x and P.x <= max.x and P.y >= min.y and P.y <= max.y and P.z >= min.z and P.z <= max.z then
      p:join(params.into)
    else
      p:leave(params.into)
    end
  end,
}
