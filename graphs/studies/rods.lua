-- rods: free rods that turn and drift, with point masses that differ by up to ten thousand, compared with the circles
-- that their ends should follow.
--
-- Shows:  the force of a rod is constant over a sub-step, along the discrete gradient between its positions at both
--         ends (Gonzalez 1996), so the positions are of second order, whatever the masses.
-- Proves: order 2 for each mass ratio (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/rods.lua -o /tmp/rods
local rapid = require "rapid"

local count, length, omega, drift = 50, 1, 5, 0.3 -- rods; m; 1/s; m/s

-- Rod i turns about the z axis from its own angle; its centre of mass drifts along x.
local function state(ratio, time)
  local P, v, mass, links = {}, {}, {}, {}
  for i = 1, count do
    local angle = 2.4 * i + omega * time
    local along, across = { math.cos(angle), math.sin(angle) }, { -math.sin(angle), math.cos(angle) }
    for k, arm in ipairs { -length * ratio / (1 + ratio), length / (1 + ratio) } do
      P[#P + 1] = { drift * time + arm * along[1], arm * along[2], 3 * i }
      v[#v + 1] = { drift + arm * omega * across[1], arm * omega * across[2], 0 }
      mass[#mass + 1] = k == 1 and 1 or ratio
    end
    links[i] = { 2 * i - 1, 2 * i }
  end
  return { P = P, v = v, mass = mass }, links
end

return rapid.study {
  name   = "rods",
  scene  = function(k)
    local set, links = state(k.ratio, 0)
    return rapid.create { fps = 24, points = rapid.points.from(set) }
      :distance { pairs = links, rest = length }
      :solve    { substeps = k.substeps, sleep = math.huge }
  end,
  frames = {1, 25},
  sweep  = { ratio = {1, 100, 10000}, substeps = {2, 4, 8, 16, 32} },
  lines  = "ratio",
  reference = function(frame, k) return { P = state(k.ratio, frame.time).P } end,
}
