-- bin: pebbles fall between two walls, come to rest, and sleep; for the viewer's pictures (tests/view/screenshots).
local rapid = require "rapid"

local friction = rapid.param("friction", 0.3, "Coulomb's coefficient")
local size = rapid.param("size", 0.05, "radius of a pebble, m")

local function wall(name, side)
  return { name = name, shape = rapid.shape.plane { normal = {side, 0, 0}, offset = -0.75 }, friction = friction }
end

return rapid.create { fps = 24, seed = 2,
    points = rapid.points.grid { size = {1, 1.2, 1}, spacing = 3 * size, center = {0, 1.2, 0} } }
  :attribute { pscale = size, mass = 1, Cd = {0.6, 0.58, 0.55} }
  :points("scatter", function(p, frame)
    if frame.number ~= 2 then return end
    p.Cd = vec3(1, 0.96, 0.9) * (0.35 + 0.5 * p:rand(1))
    p.P = p.P + (vec3(p:rand(2), p:rand(3), p:rand(4)) - vec3(0.5, 0.5, 0.5)) * size
  end)
  :gravity {}
  :collide { name = "floor", shape = rapid.shape.plane {}, friction = friction }
  :collide(wall("west", 1))
  :collide(wall("east", -1))
  :contact { friction = friction }
  :solve { substeps = 8, iterations = 4 }
