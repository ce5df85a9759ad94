-- fountain: drops rise, fall and splash; tests/view/screenshots misspells one of its nodes while it is looked at.
local rapid = require "rapid"

local rate = rapid.param("rate", 3000, "drops a second")
local speed = rapid.param("speed", 5, "out of the nozzle, m/s")

return rapid.create { fps = 24, seed = 1 }
  :emit { source = rapid.shape.sphere { radius = 0.05, center = {0, 0.2, 0} }, rate = rate, life = 2,
          velocity = {0, speed, 0}, spread = 12, attributes = { pscale = 0.015, Cd = {0.4, 0.7, 1} } }
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0.4, friction = 0.2 }
  :solve {}
