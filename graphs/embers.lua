-- embers: glowing flakes leave a bed of coals, wander upwards in a draught, and go out one by one.
--
-- Shows:  emission in a volume, a random number of its own for each point, :delete by a function of the point.
-- Proves: no ember that has gone out is left at the end of a frame (tests/graphs/test_embers.lua).
-- Run:    rapid run graphs/embers.lua -f 1-120 -o /tmp/embers.####.png
local rapid = require "rapid"

local rate = rapid.param("rate", 900, "embers born per second")
local draught = rapid.param("draught", 2.2, "upward pull of the hottest embers, m/s²")

local coals = rapid.mesh.box { size = {1.6, 0.15, 0.5}, center = {0, 0.075, 0} }

return rapid.create { fps = 24, seed = 3 }
  :emit      { source = coals, from = "volume", rate = rate, birth = "random", velocity = {0, 0.4, 0}, spread = 60,
               attributes = { heat = 1, Cd = {1, 0.7, 0.3} } }
  :points    ("wander", function(p, frame)
      -- Each ember swings with its own rate and phase: p:rand(k) is the same in every frame.
      local pace, phase = 1.5 + 2.5 * p:rand(1), 6.2832 * p:rand(2)
      local sway = vec3(math.sin(pace * frame.time + phase), 0, math.cos(1.3 * pace * frame.time + phase))
      local rise = vec3(0, draught * p.heat - 0.4, 0)
      -- The drag is solved exactly over the time that the point moves, so it holds at any frame rate.
      p.v = (p.v + (sway * 1.2 + rise) * p.dt) * math.exp(-0.6 * p.dt)
      p.heat = p.heat * math.exp(-p.dt / (0.8 + 2 * p:rand(3)))
      p.Cd = vec3(1, 0.75 * p.heat, 0.35 * p.heat * p.heat) * (0.25 + 0.75 * p.heat)
    end)
  :delete    { where = function(p) return p.heat < 0.06 end }
  :solve     {}
