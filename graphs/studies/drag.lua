-- drag: points slowed by air in three ways, compared with the exponential.
--
-- Shows:  where an edit of v belongs. In :points it is made once a frame, and no sub-step improves it. In :action it is
--         made at each sub-step: first order, since it depends on the velocity that it writes. :drag hands Solve its
--         rate, and is exact.
-- Proves: the node is exact, the action of order 1, the kick of order 0 (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/drag.lua -o /tmp/drag
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

local ways = {
  node   = function(input) return input:drag { linear = rate } end,
  action = function(input)
    return input:action("slow", function(p, step) p.v = p.v * (1 - rate * step.dt) end)
  end,
  kick   = function(input) return input:points("slow", function(p) p.v = p.v * (1 - rate * p.dt) end) end,
}

return rapid.study {
  name   = "drag",
  scene  = function(k)
    return ways[k.way](rapid.create { points = rapid.points.from(slowed(0)) }):solve { substeps = k.substeps }
  end,
  frames = {1, 25},
  sweep  = { way = {"node", "action", "kick"}, substeps = {1, 2, 4, 8, 16} },
  lines  = "way",
  reference = function(frame) return slowed(frame.time) end,
}
