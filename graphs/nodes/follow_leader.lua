-- follow_leader: a swarm follows one point that circles.
--
-- Shows:  :follow_leader; the picture is frame 60.
-- Proves: tests/lua/nodes/test_follow_leader.lua: each point reaches its place, at most at its speed.
-- Run:    rapid run graphs/nodes/follow_leader.lua -f 60 --size 288x162 -o /tmp/follow_leader.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit   { source = rapid.shape.box { size = {2.4, 1, 0.6} }, impulse = { [1] = 6000 },
            attributes = { Cd = {0.4, 0.8, 1}, pscale = 0.009 } }
  :group  { name = "head", where = function(p) return p.id == 0 end }
  :points ("lead", function(p, frame)
      if p.id > 0 then return end
      local turn = 2.2 * frame.time
      p.v = (vec3(1.1 * math.cos(turn), 0.45 * math.sin(2 * turn), 0.3 * math.sin(turn)) - p.P) / p.dt
      p.Cd, p.pscale = vec3(1, 0.6, 0.2), 0.04
    end)
  :follow_leader { leader = "head", distance = 0.15, length = 1.4, width = 0.15, time = 0.3 }
  :solve  {}
