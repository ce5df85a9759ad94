-- action: the same circle by two actions: a force that depends on the position, and one that depends on the velocity.
--
-- Shows:  what decides the order of an :action. Solve calls it in the middle of a sub-step, when P is already there but
--         v is still the old one. A force of P is of second order; a force of v, here a magnet's, is of first order.
-- Proves: the orders are 2 and 1 (tests/graphs/test_studies.lua).
-- Run:    rapid study graphs/studies/action.lua -o /tmp/action
local rapid = require "rapid"

local omega, count = 2, 1000 -- rad/s
local up = vec3(0, 1, 0)

local function on_circle(time)
  local P, v = {}, {}
  for i = 1, count do
    local angle = 2 * math.pi * i / count + omega * time
    P[i] = {math.cos(angle), 0, -math.sin(angle)}
    v[i] = {-omega * math.sin(angle), 0, -omega * math.cos(angle)}
  end
  return { P = P, v = v }
end

local forces = {
  ["of P"] = function(p) p.force = p.force - omega ^ 2 * p.P end,
  ["of v"] = function(p) p.force = p.force + omega * up:cross(p.v) end,
}

return rapid.study {
  name   = "order of an action",
  scene  = function(k)
    return rapid.create { points = rapid.points.from(on_circle(0)) }
      :action("turn", forces[k.force])
      :solve { substeps = k.substeps }
  end,
  frames = {1, 49},
  sweep  = { force = {"of P", "of v"}, substeps = {1, 2, 4, 8, 16} },
  lines  = "force",
  reference = function(frame) return on_circle(frame.time) end,
}
