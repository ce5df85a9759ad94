-- nearest_place: writes where the surface of a shape or mesh is nearest to each point, at the end of the frame.
--
--   place = P - φ ∇φ / |∇φ|²            φ: the distance
--
-- With :goal points come down on whatever moves. Where a level set has no gradient, beyond its band, the place is P.
local rapid = require "rapid"

return rapid.node {
  name = "nearest_place",
  doc  = "Writes the nearest place of a surface to an attribute.",
  params = {
    shape = { "shape", required = true, doc = "a shape, a level set or a mesh, at rest, moving or deforming" },
    into  = { "write", default = "goal", doc = "a vec3, for the place" },
  },
  makes = { goal = {0, 0, 0} },
  points = function(p, _, params)
    local P = p.P
    local n = params.shape:gradient(P)
    local slope2 = n:dot(n)
    p[params.into] = slope2 > 0 and P - n * (params.shape:distance(P) / slope2) or P
  end,
}
