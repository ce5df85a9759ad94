-- A rope that falls from the horizontal, held at one end, and swings: it never has more energy than at first, nor much
-- less.
local scene = require "testing.scene"

-- The most and the least by which energy has changed since the start, of half the rope's weight times its length.
local function swing()
  local count, size, m, g = 30, 1 / 30, 0.1, 9.81
  local P, pairs_text = {}, {}
  for i = 0, count do
    P[i + 1] = ("{%.9g, 0, 0}"):format(i * size)
    if i > 0 then pairs_text[i] = ("{%d, %d}"):format(i, i + 1) end
  end
  local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s} } }
  :attribute { mass = %g } :gravity { g = {0, %g, 0} } :distance { pairs = {%s} }
  :group { name = "hook", where = function(p) return p.id == 0 end } :pin { group = "hook" }
  :solve { substeps = 10 }]]):format(table.concat(P, ", "), m, -g, table.concat(pairs_text, ", ")),
    { frames = {1, 241} })
  local most, least = 0, 0
  for _, points in result:frames() do
    local energy = 0
    for i = 1, #points do energy = energy + m * (points[i].v:dot(points[i].v) / 2 + g * points[i].P.y) end
    local part = energy / (count * m * g * count * size / 2)
    most, least = math.max(most, part), math.min(least, part)
  end
  return most, least
end

return {
  {
    feature = "distance",
    law = "rope of 30 links from the horizontal, 10 sub-steps, 10 s: most energy above the start, of m g L/2",
    reference = "conservation", at_most = 0.01,
    measure = function() return (swing()) end,
  },
  {
    feature = "distance", law = "the same: loss in 10 s", reference = "conservation", at_most = 0.02,
    measure = function() return -select(2, swing()) end,
  },
}
