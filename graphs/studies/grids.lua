-- grids: rubble of radii from 1 to 16 comes down, by the number of grids in the contact search (the paper's §5.2).
--
-- Shows:  max_grids affects only time: pairs, and so positions, are bit-identical for any number of grids; with one
--         grid, small grains are searched in the cells of the large ones.
-- Proves: the error is 0 in every row (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/grids.lua -o /tmp/grids
local rapid = require "rapid"

local places, radii, masses = {}, {}, {}
local count = 3000
for k = 1, count do
  -- Few are large: each doubling of the volume has the same number.
  local r = 0.01 * 16 ^ (((k * 0.618034) % 1) ^ 6)
  radii[k], masses[k] = r, 1e4 * r ^ 3
  places[k] = {(k * 0.754878) % 1, 0.2 + 3 * k / count, (k * 0.569840) % 1}
end

return rapid.study {
  name   = "grids",
  scene  = function(k)
    return rapid.create { fps = 24, points = rapid.points.from { P = places, pscale = radii, mass = masses } }
      :gravity {}
      :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.5 }
      :contact { friction = 0.4, max_difference = 0.002, max_grids = k.max_grids }
      :solve   { substeps = 8 }
  end,
  frames = {1, 25},
  sweep  = { max_grids = {1, 2, 4, 8, 16} },
  reference = { max_grids = 3 },
}
