-- spring: the same spring as a node and as an action in Lua, compared with the cosine that both should follow.
--
-- Shows:  a node has knowledge that a script cannot express: :spring hands Solve its stiffness, which is solved exactly
--         at any step; an :action only adds a force, which Solve takes in the middle of each sub-step: second order,
--         and stable only up to omega dt = 2.
-- Proves: the node is exact, the action of order 2 (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/spring.lua -o /tmp/spring
local rapid = require "rapid"

local stiffness = 90 -- N/m at a mass of 1 kg
local omega = math.sqrt(stiffness)
local count = 1000

-- Each point swings about 0 from its own position.
local function swung(time)
  local P = {}
  for i = 1, count do P[i] = {i / count * math.cos(omega * time), 0, 0} end
  return { P = P }
end

local ways = {
  node   = function(input) return input:spring { stiffness = stiffness } end,
  action = function(input)
    return input:action("spring", function(p) p.force = p.force - stiffness * p.P end)
  end,
}

return rapid.study {
  name   = "spring",
  scene  = function(k)
    return ways[k.way](rapid.create { points = rapid.points.from(swung(0)) }):solve { substeps = k.substeps }
  end,
  frames = {1, 25},
  sweep  = { way = {"node", "action"}, substeps = {1, 2, 4, 8, 16} },
  lines  = "way",
  reference = function(frame) return swung(frame.time) end,
}
