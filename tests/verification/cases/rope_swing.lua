-- A rope held at one end falls from the horizontal and swings. It must never gain energy and lose little. The same is
-- done with a uniformly moving hook, in its frame. There the solver has no bound on the energy of an island, so the
-- forces of the rods must conserve it.
local scene = require "testing.scene"

-- Returns the largest and smallest change of energy since the start, relative to half the rope's weight times its
-- length. u: velocity of the hook, m/s.
local function swing(u)
  local count, size, m, g = 30, 1 / 30, 0.1, 9.81
  local P, v, pairs_text = {}, {}, {}
  for i = 0, count do
    P[i + 1], v[i + 1] = ("{%.9g, 0, 0}"):format(i * size), ("{%g, 0, 0}"):format(u)
    if i > 0 then pairs_text[i] = ("{%d, %d}"):format(i, i + 1) end
  end
  local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s} } }
  :attribute { mass = %g } :gravity { g = {0, %g, 0} } :distance { pairs = {%s} }
  :group { name = "hook", where = function(p) return p.id == 0 end }
  :pin { group = "hook", transform = function(frame) return rapid.translate(%g * frame.time, 0, 0) end }
  :solve { substeps = 10 }]]):format(table.concat(P, ", "), table.concat(v, ", "), m, -g,
    table.concat(pairs_text, ", "), u), { frames = {1, 241} })
  local most, least = 0, 0
  for _, points in result:frames() do
    local energy = 0
    for i = 1, #points do
      local seen = points[i].v - vec3(u, 0, 0)
      energy = energy + m * (seen:dot(seen) / 2 + g * points[i].P.y)
    end
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
    measure = function() return (swing(0)) end,
  },
  {
    feature = "distance", law = "the same: loss in 10 s", reference = "conservation", at_most = 0.02,
    measure = function() return -select(2, swing(0)) end,
  },
  {
    feature = "distance, pin", law = "the same on a hook that goes at 1 m/s: most energy above the start, seen from it",
    reference = "conservation", at_most = 0.01,
    measure = function() return (swing(1)) end,
  },
  {
    feature = "distance, pin", law = "the same: loss in 10 s", reference = "conservation", at_most = 0.02,
    measure = function() return -select(2, swing(1)) end,
  },
}
