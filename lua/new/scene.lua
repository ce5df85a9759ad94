-- NAME: a fountain plays on a floor.
--
-- Run:   rapid run NAME.lua -f 1-96 -o NAME.####.png
-- Test:  rapid test test_NAME.lua
local rapid = require "rapid"

local rate = rapid.param("rate", 4000, "drops born per second")

return rapid.create { fps = 24, seed = 1 }
  :emit    { source = rapid.mesh.sphere { radius = 0.05, center = {0, 0.2, 0} }, rate = rate, birth = "random",
             velocity = {0, 4, 0}, spread = 12, life = 2, attributes = { Cd = {0.5, 0.75, 1} } }
  :points  ("breeze", function(p)
      p.v = p.v + vec3(0.5, 0, 0) * p.dt
    end)
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0.3, friction = 0.2 }
  :solve   {}
