-- splash: drops fall on a stone in a pool, and throw up crowns of droplets where and when they hit.
--
-- Shows:  on = "hit" with a minimum speed, births off the surface along its normal, split, a second chain.
-- Proves: droplets begin at contacts of their drops, on a surface, and together have the mass of the drop
--         (tests/graphs/test_splash.lua).
-- Run:    rapid run graphs/splash.lua -f 1-72 --camera 0,1.6,4.2,0,0.5,0 -o /tmp/splash.####.png
local rapid = require "rapid"

local rate = rapid.param("rate", 220, "drops per second")

local cloud = rapid.mesh.grid { size = {2.4, 2.4}, divisions = 1, center = {0, 3, 0} }
local stone = rapid.shape.sphere { radius = 0.6, center = {0, 0.2, 0} }
local pool  = rapid.shape.plane {}

local drops = rapid.create { fps = 24, seed = 3 }
  :emit    { source = cloud, rate = rate, velocity = {0, -3, 0}, spread = 2, life = 2,
             attributes = { pscale = 0.022, mass = 4e-5, Cd = {0.35, 0.6, 0.95} } }
  :gravity {}
  :collide { shape = stone, response = "die" } :collide { shape = pool, response = "die" }
  :solve   {}

local crown = rapid.create { fps = 24, seed = 3 }
  :spawn   { from = drops, on = "hit", min_speed = 2, count = 24, split = true, inherit_velocity = 0,
             speed = 2.1, spread = 55, life = {0.3, 0.8}, attributes = { Cd = {0.8, 0.92, 1} } }
  :gravity {} :drag { linear = 0.4 }
  :collide { shape = stone, bounce = 0.1, friction = 0.3 } :collide { shape = pool, response = "die" }
  :solve   {}

return crown:merge(drops)
