-- net: a square net hangs from two corners and swings; the error is the greatest stretch of a link.
--
-- Shows:  sub-steps before iterations (Macklin et al. 2019): the same number of sweeps stretches a net less as
--         sub-steps of one iteration each than as iterations in four sub-steps. Chains and trees are solved directly; a
--         net is not.
-- Proves: sub-steps stretch the net less than iterations at each cost, and less with each doubling
--         (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/net.lua -o /tmp/net
local rapid = require "rapid"

local side, spacing = 16, 0.1 -- knots along an edge; m

local places, links = {}, {}
for i = 0, side - 1 do
  for j = 0, side - 1 do
    local k = side * i + j + 1
    places[k] = {spacing * i, 0, spacing * j}
    if j > 0 then links[#links + 1] = {k - 1, k} end
    if i > 0 then links[#links + 1] = {k - side, k} end
  end
end

-- Returns the largest strain of all links in all frames, whose columns follow each other.
local function strain(points)
  local worst = 0
  for frame = 0, #points.P - 1, side * side do
    for _, link in ipairs(links) do
      local length = (points.P[frame + link[1]] - points.P[frame + link[2]]):length()
      worst = math.max(worst, math.abs(length / spacing - 1))
    end
  end
  return worst
end

return rapid.study {
  name   = "net",
  scene  = function(k)
    local by_substeps = k.sweeps_as == "sub-steps"
    return rapid.create { fps = 24, points = rapid.points.from { P = places } }
      :group    { name = "corners", where = function(p) return p.id == 0 or p.id == side - 1 end }
      :gravity  {}
      :distance { pairs = links }
      :pin      { group = "corners" }
      :solve    { substeps = by_substeps and k.sweeps or 4, iterations = by_substeps and 1 or k.sweeps / 4 }
  end,
  frames = {1, 37},
  sweep  = { sweeps_as = {"sub-steps", "iterations"}, sweeps = {8, 16, 32, 64, 128} },
  lines  = "sweeps_as",
  reference = function() return { P = places } end,
  error  = strain,
}
