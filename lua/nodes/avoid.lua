-- avoid: pushes points away from a shape, more strongly the nearer they are.
--
--   v' = strength (1 - d / distance) n            d: distance to the surface, 0 < d < distance;  n: out of the shape
--
-- Inside the shape the full strength acts. A level set knows d within its band only: make its half_width reach that
-- far.
local rapid = require "rapid"

return rapid.node {
  name = "avoid",
  doc  = "Pushes points away from a shape that they come near.",
  params = {
    shape    = { "shape", required = true, doc = "shape or level set" },
    distance = { "float", default = 0.5, min = 1e-6, unit = "m",
                 doc = "distance from the surface at which the push begins" },
    strength = { "float", default = 10, unit = "m/s²", doc = "acceleration at the surface" },
  },
  points = function(p, _, params)
    local near = 1 - params.shape:distance(p.P) / params.distance
    if near > 0 then
      local n = params.shape:gradient(p.P):normalized()
      p.v = p.v + n * (params.strength * math.min(near, 1) * p.dt)
    end
  end,
}
