-- Newton's cradle: a sphere at 1 m/s hits five touching spheres in line, with a bounce of 1.
local scene = require "testing.scene"

local r = 0.05

local function energies()
  local result, list = scene.run(([[
local P, v = {{-0.5, 0, 0}}, {{1, 0, 0}}
for i = 1, 5 do P[i + 1], v[i + 1] = {(i - 1) * 2 * %g, 0, 0}, {0, 0, 0} end
return rapid.create { fps = 24, points = rapid.points.from { P = P, v = v } }
  :contact { radius = %g, bounce = 1 } :solve { substeps = 16 }]]):format(r, r), { frames = {1, 25} }), {}
  for frame, points in result:frames() do
    list[frame] = 0
    for i = 1, #points do list[frame] = list[frame] + points[i].v:dot(points[i].v) end
  end
  return list
end

return {
  {
    feature = "contact", law = "cradle of five: energy after the hit, of that before", reference = "conservation",
    at_least = 0.99, at_most = 1 + 1e-5,
    measure = function() return energies()[25] end,
  },
  {
    feature = "contact", law = "the same: the most in any frame", reference = "conservation",
    at_least = 0.99, at_most = 1 + 1e-5,
    measure = function() return math.max(unpack(energies())) end,
  },
}
