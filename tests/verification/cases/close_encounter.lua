-- Points on ellipses of eccentricity 0.9 to 0.999 around a centre with an inverse-square attraction, one revolution,
-- with a tolerance: the error must be within the tolerance per frame times the number of frames.
local scene = require "testing.scene"

local tolerance, strength = 1e-4, 1

-- Returns the position at time t on an ellipse with semi-axis 1, starting at its far end, from Kepler's equation.
local function ellipse(e, t)
  local mean = math.pi + t * math.sqrt(strength)
  local low, high = mean - 1, mean + 1
  for _ = 1, 100 do
    local mid = (low + high) / 2
    if mid - e * math.sin(mid) < mean then low = mid else high = mid end
  end
  return vec3(math.cos(low) - e, math.sqrt(1 - e * e) * math.sin(low), 0)
end

return {
  {
    feature = "attract",
    law = "ellipses of eccentricity 0.9 to 0.999, past the centre, tolerance 0.1 mm: error, of that by the frames",
    reference = "Kepler's equation", at_most = 1,
    measure = function()
      local list, P, v = { 0.9, 0.95, 0.99, 0.995, 0.999 }, {}, {}
      for i, e in ipairs(list) do
        P[i] = ("{%.17g, 0, 0}"):format(-1 - e)
        v[i] = ("{0, %.17g, 0}"):format(-math.sqrt(strength * (1 - e) / (1 + e)))
      end
      local frames, worst = 121, 0  -- 5 s; the centre is passed at pi
      local points = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s} } }
  :attract { strength = %g } :solve { tolerance = %g, max_substeps = 1048576 }]]):format(table.concat(P, ", "),
        table.concat(v, ", "), strength, tolerance), { frames = {frames, frames} })[frames]
      for i, e in ipairs(list) do
        local off = (points[i].P - ellipse(e, (frames - 1) / 24)):length()
        worst = math.max(worst, off / (tolerance * (frames - 1)))
      end
      return worst
    end,
  },
}
