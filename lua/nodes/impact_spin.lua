-- impact_spin: sets points that hit a surface spinning, up to the rate at which they would roll.
--
--   w' = w + grip (n × u / r - w)            u: velocity relative to the surface;  r: pscale
--
-- This acts in the frame after a contact that :collide{ record = true } has written to the hit attributes.
local rapid = require "rapid"

return rapid.node {
  name = "impact_spin",
  doc  = "Makes points spin after they hit a shape.",
  params = {
    grip = { "float", default = 1, min = 0, max = 1,
             doc = "fraction of the change to rolling that each contact makes" },
  },
  makes = { w = {0, 0, 0} },
  points = function(p, _, params)
    if p.hitnum == 0 then return end
    if p.pscale == 0 then error("a point of pscale 0 does not roll; give it a pscale") end
    local roll = p.hitnml:cross(p.v - p.hitv) / p.pscale
    p.w = p.w + (roll - p.w) * params.grip
  end,
}
