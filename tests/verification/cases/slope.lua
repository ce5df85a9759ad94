-- A point on a slope, alone and among coupled points: at rest below the angle of friction, otherwise accelerating with
-- g (sin - mu cos).
local scene = require "testing.scene"

local g, mu, frames = 9.81, 0.4, 25

-- Returns how far a point slides down a slope of this angle in a second, starting at rest. extra: nodes.
local function way(degrees, extra)
  local angle = math.rad(degrees)
  local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{%.9g, %.9g, 0}, {50, 0, 50}} } }
  :gravity { g = {0, -%g, 0} } :collide { shape = rapid.shape.plane { normal = {%.9g, %.9g, 0} }, friction = %g,
    radius = 0.1, bounce = 0 } %s :solve { substeps = 8 }]]):format(0.1 * math.sin(angle), 0.1 * math.cos(angle), g,
    math.sin(angle), math.cos(angle), mu, extra), { frames = {1, frames} })
  local first, last = result[1]:by_id(0), result[frames]:by_id(0)
  return (last.P - first.P):length()
end

local function off(extra)
  local worst, time = 0, (frames - 1) / 24
  for _, degrees in ipairs { 5, 15, 21, 21.7, 21.9, 25, 40, 60, 80 } do
    local angle = math.rad(degrees)
    local expected = g * math.max(0, math.sin(angle) - mu * math.cos(angle)) * time ^ 2 / 2
    worst = math.max(worst, math.abs(way(degrees, extra) - expected))
  end
  return worst
end

return {
  {
    feature = "collide", law = "slip on a slope, 5 to 80 degrees, friction 0.4, 1 s: error of the way",
    reference = "closed form", at_most = 2e-5, unit = "m",
    measure = function() return off "" end,
  },
  {
    feature = "collide, contact", law = "the same of a grain", reference = "closed form", at_most = 1e-3, unit = "m",
    measure = function() return off ":contact { radius = 0.1, friction = 0.4 }" end,
  },
}
