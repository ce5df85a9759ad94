-- torque: changes the angular velocity `w` of points; :tumble, or :contact{ spin = true }, turns them by it.
--
--   w' = torque / I            I: given, or that of a solid sphere, 2/5 mass pscale²
local rapid = require "rapid"

return rapid.node {
  name = "torque",
  doc  = "Changes the angular velocity w of points by a torque.",
  params = {
    torque  = { "vec3", default = {0, 0, 0}, unit = "N m", doc = "torque in world space" },
    inertia = { "float", default = 0, min = 0, unit = "kg m²",
                doc = "moment of inertia; 0 for that of a solid sphere" },
  },
  makes = { w = {0, 0, 0} },
  points = function(p, _, params)
    local inertia = params.inertia
    if inertia == 0 then inertia = 0.4 * p.mass * p.pscale * p.pscale end
    if inertia == 0 then error("a point of pscale 0 has no moment of inertia; give it a pscale, or inertia") end
    p.w = p.w + params.torque * (p.dt / inertia)
  end,
}
