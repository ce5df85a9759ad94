-- Elastic bounces inside level sets: the shape's symmetry conserves energy and angular momentum.
local scene = require "testing.scene"
local matrix = require "tests.verification.matrix"

local count = 40

-- Points bounce between two spherical walls or along the inside of a torus for 2 s. Returns the largest changes of v²
-- and of the angular momentum about y, relative to their initial values.
local function changes(shape)
  local P, v = {}, {}
  for i = 1, count do
    local angle, tilt = 2.4 * i, 0.3 * math.sin(1.7 * i)
    P[i] = ("{%.9g, 0, %.9g}"):format(math.cos(angle), math.sin(angle))
    v[i] = ("{%.9g, %.9g, %.9g}"):format(-2 * math.sin(angle + tilt), 0.5 * math.cos(3 * i), 2 * math.cos(angle + tilt))
  end
  local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {%s}, v = {%s} } }
  :collide { shape = %s, bounce = 1 } :solve {}]]):format(table.concat(P, ", "), table.concat(v, ", "), shape),
    { frames = {1, 49} })
  local energy, spin = 0, 0
  local function spin_of(p) return p.P.z * p.v.x - p.P.x * p.v.z end
  for i = 1, count do
    local before = result[1]:by_id(i - 1)
    for frame = 2, 49 do
      local now = result[frame]:by_id(i - 1)
      energy = math.max(energy, math.abs(now.v:dot(now.v) / before.v:dot(before.v) - 1))
      spin = math.max(spin, math.abs(spin_of(now) / spin_of(before) - 1))
    end
  end
  return energy, spin
end

local function inside_of_torus(voxel)
  return changes(("rapid.levelset.box { size = {4, 2, 4}, voxel = %g }:subtract(rapid.levelset.torus { radius = 1, " ..
    "tube = 0.4, voxel = %g })"):format(voxel, voxel))
end

return {
  {
    feature = "collide", law = "40 points in the tube of a level set, bounce 1, 2 s: largest change of energy",
    reference = "conservation", at_most = 1e-5,
    measure = function() return (inside_of_torus(0.04)) end,
  },
  {
    feature = "collide", law = "the same, voxels of a twentieth of the tube: of angular momentum about the axis",
    reference = "conservation", at_most = 0.05, order = 1,
    measure = function()
      local steps, errors = { 0.08, 0.04, 0.02 }, {}
      for i, voxel in ipairs(steps) do errors[i] = select(2, inside_of_torus(voxel)) end
      return errors[3], matrix.order(steps, errors)
    end,
  },
}
