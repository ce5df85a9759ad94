-- group_by_shape: puts the points in or near a shape into a group, at each frame.
--
-- A level set knows distances within its band only: a larger `distance` reaches no farther than the band.
local rapid = require "rapid"

return rapid.node {
  name = "group_by_shape",
  doc  = "Puts the points in or near a shape into a group and removes all others from it.",
  params = {
    into     = { "group", required = true, doc = "name of the group" },
    shape    = { "shape", required = true, doc = "shape or level set" },
    distance = { "float", default = 0, unit = "m",
                 doc = "maximum signed distance of members from the surface; negative values are inside" },
  },
  points = function(p, _, params)
    if params.shape:distance(p.P) <= params.distance then p:join(params.into) else p:leave(params.into) end
  end,
}
