-- follow_curve: moves each point along a curve from its birthplace, as if the curve began there.
--
--   P(age) = P(0) + C(age / duration) - C(0)            C: a Catmull-Rom spline through the points, C(0) to C(1)
--
-- The velocity is the chord over the point's time, so Solve moves it there exactly. Beyond the end the point keeps its
-- last direction and speed.
local rapid = require "rapid"

-- Returns the curve at u, in spans; the tangents at both ends are those of the last spans.
local function at(points, u)
  local spans = #points - 1
  local k = math.min(math.floor(u), spans - 1)
  local t = u - k
  local b, c = points[k + 1], points[k + 2]
  local a = k > 0 and points[k] or b * 2 - c
  local d = k + 2 < spans + 1 and points[k + 3] or c * 2 - b
  if t > 1 then return c + (d - b) * ((t - 1) / 2) end
  return b + (c - a) * (t / 2) + (a * 2 - b * 5 + c * 4 - d) * (t * t / 2)
    + ((b - c) * 3 + d - a) * (t * t * t / 2)
end

return rapid.node {
  name = "follow_curve",
  doc  = "Moves points along a curve.",
  params = {
    points   = { "vec3s", required = true, unit = "m", doc = "positions that the curve passes through, at least two" },
    duration = { "float", default = 1, min = 1e-6, unit = "s",
                 doc = "time from the first position to the last; each span takes the same part of it" },
  },
  points = function(p, _, params)
    local points = params.points
    if #points < 2 then error("points: a curve needs at least two") end
    local rate = (#points - 1) / params.duration
    if p.dt > 0 then
      p.v = (at(points, (p.age + p.dt) * rate) - at(points, p.age * rate)) / p.dt
    end
  end,
}
