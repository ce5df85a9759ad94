-- smoke: a plume of points that rises and curls, and writes the sequence of volumes that ash.lua reads.
--
-- Run:    rapid run graphs/smoke/smoke.lua -f 49-113x16 --set to=graphs/smoke/smoke.####.vdb
local rapid = require "rapid"

local to = rapid.param("to", "smoke.####.vdb", "pattern of the files that are written")
local voxel = rapid.param("voxel", 0.3, "edge of a voxel, metres")

return rapid.create { fps = 24, seed = 8 }
  :emit       { source = rapid.mesh.sphere { radius = 0.3, center = {0, 0.2, 0} }, from = "volume", rate = 1500,
                velocity = {0, 1.2, 0}, spread = 15, life = {1.4, 2.6}, attributes = { pscale = 0.06 } }
  :points     ("rise", function(p, frame)
      local lift = 3.2 * math.exp(-0.5 * p.age)
      local sway = 0.5 * math.sin(1.6 * frame.time - 1.4 * p.P.y)
      p.v = p.v + vec3(sway, lift, 0.6 * sway) * p.dt
    end)
  :wind       { velocity = {0.25, 0.4, 0}, drag = 1.1 }
  :turbulence { amplitude = 4, size = 0.9, speed = 0.6, octaves = 2 }
  :solve      { substeps = 2 }
  :rasterize  { file = to, voxel = voxel, radius = 1.6 * voxel }
