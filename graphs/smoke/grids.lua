-- grids: the points of smoke.lua become fogs and grids of velocity, one file for each sixteenth frame.
--
-- Run:    as smoke.lua says
local rapid = require "rapid"

local points = rapid.param("points", "", "pattern of the points' files, with the frame as %04d")
local to = rapid.param("to", "", "pattern of the files that are written")
local voxel = rapid.param("voxel", 0.3, "edge of a voxel, metres")

local last
for frame = 49, 113, 16 do
  local smoke = rapid.points.read(points:format(frame))
  local options = { voxel = voxel, radius = 1.6 * voxel }
  last = rapid.fog.from_points(smoke, options)
  rapid.grid.write(to:format(frame), { density = last, v = rapid.grid.from_points(smoke, options) })
end

-- What the last one holds, to look at.
return rapid.create {} :emit { source = last, impulse = { [1] = 4000 } } :solve {}
