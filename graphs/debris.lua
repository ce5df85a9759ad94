-- debris: a wall of rubble of three sizes comes down, and the small falls through the large.
--
-- Shows:  :contact with clusters of radii, each in a grid of its own (max_difference, max_grids); masses proportional
--         to the volume; pieces that bounce.
-- Proves: three grids hold the three sizes, nothing overlaps deeply, and the small pieces end lower than the large ones
--         (tests/graphs/test_debris.lua).
-- Run:    rapid run graphs/debris.lua -f 1-96 -o /tmp/debris.####.png
local rapid = require "rapid"

-- Radius, count and colour of each cluster; radii vary by a tenth.
local sizes = {
  { 0.12, 24, {0.55, 0.5, 0.45} }, { 0.05, 220, {0.7, 0.62, 0.5} }, { 0.02, 1400, {0.8, 0.75, 0.65} },
}

local grids = rapid.param("max_grids", 8, "grids for the radii")

local chain = rapid.create { fps = 24, seed = 11 }
for k, size in ipairs(sizes) do
  chain = chain:emit {
    name = "size" .. k, source = rapid.levelset.box { size = {0.8, 1.8, 0.8}, center = {0, 1.6, 0}, voxel = 0.05 },
    from = "volume", impulse = { [2] = size[2] }, age = 0, attributes = { pscale = size[1], Cd = size[3], fresh = 1 },
  }
end

return chain
  :points  ("vary", function(p)
      if p.fresh > 0 then
        p.pscale = p.pscale * (0.9 + 0.2 * p:rand(1))
        p.mass = 1e4 * p.pscale ^ 3
        p.fresh = 0
      end
    end)
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0.2, friction = 0.6 }
  :contact { bounce = 0.2, friction = 0.4, max_difference = 0.03, max_grids = grids }
  :solve   { substeps = 12 }
