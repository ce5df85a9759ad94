-- A rope of links at rest between two hooks, compared with the catenary.
local scene = require "testing.scene"

local links, span, length = 100, 1, 1.6

-- Returns the depth of a catenary of this length below hooks at equal height: y = a cosh(x/a), length = 2a
-- sinh(span/2a).
local function sag()
  local low, high = 0.01, 10
  for _ = 1, 100 do
    local a = (low + high) / 2
    if 2 * a * math.sinh(span / (2 * a)) > length then low = a else high = a end
  end
  return low * (math.cosh(span / (2 * low)) - 1)
end

local function hanging()
  local step, P, pairs_text = length / links, {}, {}
  for i = 0, links do
    -- Starts as a triangle with the rope's length.
    local half = math.sqrt((length / 2) ^ 2 - (span / 2) ^ 2)
    local part = i / links
    P[i + 1] = ("{%.9g, %.9g, 0}"):format(span * (part - 0.5), -half * (1 - math.abs(2 * part - 1)))
    if i > 0 then pairs_text[i] = ("{%d, %d}"):format(i, i + 1) end
  end
  local points = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s} } }
  :gravity {} :drag { linear = 3 } :distance { pairs = {%s}, rest = %.9g }
  :group { name = "hooks", where = function(p) return p.id == 0 or p.id == %d end } :pin { group = "hooks" }
  :solve { substeps = 8, sleep = math.huge }]]):format(table.concat(P, ", "), table.concat(pairs_text, ", "), step,
    links), { frames = {481, 481} })[481]
  return -points:min("P").y
end

return {
  {
    feature = "distance", law = "rope of 100 links between two hooks: its sag by the catenary's",
    reference = "closed form", at_least = 0.999, at_most = 1.001,
    measure = function() return hanging() / sag() end,
  },
}
