-- subframes: a drag that a script applies once a frame, with two kinds of smaller steps, compared with the exponential.
--
-- Shows:  the purpose of create's subframes. Sub-steps belong to Solve, and a script before Solve does not see them;
--         sub-frames evaluate the whole graph more often, including the script.
-- Proves: by sub-frames the order is 1, by sub-steps 0 (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/subframes.lua -o /tmp/subframes
local rapid = require "rapid"

local rate, count = 3, 1000 -- 1/s

-- Returns the state of points that started from 0 with their own velocities.
local function slowed(time)
  local P, v = {}, {}
  for i = 1, count do
    P[i] = {i / count * (1 - math.exp(-rate * time)) / rate, 0, 0}
    v[i] = {i / count * math.exp(-rate * time), 0, 0}
  end
  return { P = P, v = v }
end

return rapid.study {
  name   = "sub-frames",
  scene  = function(k)
    return rapid.create { points = rapid.points.from(slowed(0)), subframes = k.way == "subframes" and k.steps or 1 }
      :points("slow", function(p) p.v = p.v * (1 - rate * p.dt) end)
      :solve { substeps = k.way == "substeps" and k.steps or 1 }
  end,
  frames = {1, 25},
  sweep  = { way = {"substeps", "subframes"}, steps = {1, 2, 4, 8, 16} },
  lines  = "way",
  reference = function(frame) return slowed(frame.time) end,
}
