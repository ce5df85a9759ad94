-- Rows that compete with each other and with a load: a bond under tension, a contact against a rod.
local scene = require "testing.scene"

-- Returns the largest kinetic energy in 2 s, J, of three points at rest that rods hold closer than their radii. With
-- `pin`, one of them is on a pin that moves at u m/s, and the energy is relative to it.
local function contradicted(u, pin)
  local most = 0
  for _, substeps in ipairs { 1, 4, 16 } do
    local result = scene.run(([[
local v = vec3(%g, 0, 0)
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0.1, 0, 0}, {0.05, 0.1, 0}},
    v = {v, v, v} } }
  :attribute { pscale = 0.1 } :distance { pairs = {{1, 2}, {2, 3}, {1, 3}}, collide = true } :contact {}
  %s:solve { substeps = %d, sleep = math.huge }]]):format(u, pin or "", substeps), { frames = {1, 49} })
    for _, points in result:frames() do
      local energy = 0
      for i = 1, #points do
        local seen = points[i].v - vec3(u, 0, 0)
        energy = energy + seen:dot(seen) / 2
      end
      most = math.max(most, energy)
    end
  end
  return most
end

return {
  {
    feature = "clump",
    law = "two bonded points pulled with 1e4 N, one sub-step: energy above the work, of the pull by a radius",
    reference = "conservation", at_most = 1e-3,
    measure = function()
      local pull, r, most = 1e4, 0.1, 0
      local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{-%g, 0, 0}, {%g, 0, 0}} } }
  :attribute { pscale = %g } :clump { strength = 1e9 }
  :action("pull", function(p) p.force = p.force + vec3(p.id == 0 and -%g or %g, 0, 0) end)
  :solve { substeps = 1, sleep = math.huge }]]):format(r, r, r, pull, pull), { frames = {1, 97} })
      local function energy(points)
        local a, b = points[1], points[2]
        return (a.v:dot(a.v) + b.v:dot(b.v)) / 2 - pull * (b.P.x - a.P.x)
      end
      for _, points in result:frames() do most = math.max(most, energy(points) - energy(result[1])) end
      return most / (pull * r)
    end,
  },
  {
    feature = "contact, distance", law = "a rod shorter than both radii, from rest: energy that comes of it, 2 s",
    reference = "conservation", at_most = 1e-6, unit = "J",
    measure = function() return contradicted(0) end,
  },
  {
    feature = "contact, distance, pin",
    law = "the same with one of its points on a pin that goes at 1 m/s, seen from it",
    reference = "conservation", at_most = 1e-6, unit = "J",
    measure = function()
      return contradicted(1, [[:group { name = "held", where = function(p) return p.id == 0 end }
  :pin { group = "held", transform = function(frame) return rapid.translate(frame.time, 0, 0) end } ]])
    end,
  },
}
