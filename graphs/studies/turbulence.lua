-- turbulence: points in curling air, compared with themselves at many sub-steps, since no closed form exists.
--
-- Shows:  a study whose reference is a setting of its own knobs; error = "p95", which ignores the few points that the
--         swirls separate; a tolerance against a number of sub-steps.
-- Proves: by sub-steps the order is 2; by a tolerance that falls with the square of the effort, as the error of a frame
--         does, each increase of the effort reduces the error (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/turbulence.lua -o /tmp/turbulence
local rapid = require "rapid"

local ways = {
  substeps  = function(effort) return { substeps = effort } end,
  tolerance = function(effort) return { tolerance = 0.002 / effort ^ 2, max_substeps = 256 } end,
}

return rapid.study {
  name   = "turbulence",
  scene  = function(k)
    return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.1 } }
      :turbulence { amplitude = 20, size = 1, speed = 1, octaves = 2 }
      :drag { linear = 1 }
      :solve(ways[k.way](k.effort))
  end,
  frames = {1, 25},
  sweep  = { way = {"substeps", "tolerance"}, effort = {1, 2, 4, 8, 16} },
  lines  = "way",
  reference = { way = "substeps", effort = 256 },
  error  = "p95",
}
