-- subframes: a drag that a script makes once a frame, by two ways to take smaller steps, against the exponential.
--
-- Shows:  what create's subframes are for. Sub-steps are Solve's own, and a script before Solve does not see them; with
--         sub-frames the whole graph is evaluated more often, and so is the script.
-- Proves: by sub-frames the order is 1, by sub-steps 0 (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/subframes.lua -o /tmp/subframes
local rapid = require "rapid"

local rate, count = 3, 1000 -- 1/s

-- Where points are that started from 0 with a velocity of their own.
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
