-- swarm: fireflies wind their way through pillars to a lamp, and form a ring there.
--
-- Shows:  :look_ahead, :arrive and :goal, in one chain.
-- Proves: no firefly touches a pillar, and all are on the ring at 4.5 s (tests/graphs/test_swarm.lua).
-- Run:    rapid run graphs/swarm.lua -f 1-120 -o /tmp/swarm.####.png
local rapid = require "rapid"

local count = rapid.param("count", 6000, "fireflies")
local ring = rapid.mesh.torus { radius = 0.7, tube = 0.08, center = {3, 0.8, 0} }

local swarm = rapid.create { fps = 24, seed = 9 }
  :emit       { source = rapid.shape.box { size = {0.6, 1.2, 2.4}, center = {-3.4, 0.8, 0} }, from = "volume",
                impulse = { [1] = count }, velocity = {2, 0, 0}, spread = 15,
                attributes = { Cd = {0.5, 1, 0.4}, pscale = 0.012 } }
  :arrive     { target = {3, 0.8, 0}, speed = 2.4, radius = 0.8, response = 1.2 }

for k = 0, 8 do
  local middle = {-1.6 + 0.7 * (k % 3), 1, 0.8 * math.floor(k / 3) - 0.8 + (k % 3 == 1 and 0.4 or 0)}
  local pillar = rapid.shape.box { size = {0.16, 4, 0.16}, center = middle }
  swarm = swarm
    :look_ahead { shape = pillar, time = 0.4, clearance = 0.08, strength = 60 }
    :collide    { shape = pillar, record = true }
end

return swarm
  :goal   { to = ring, by = "random", start = 3, time = 1, stagger = 0.5 }
  :points ("glow", function(p) p.Cd = vec3(0.5, 1, 0.4):lerp(vec3(1, 0.6, 0.2), (p.P.x + 3) / 6) end)
  :solve  {}
