-- rain on a driving car, for Blender: graphs/blender/rain.py makes the shot.
--
-- Shows:  rapid.host with a collider that Blender animates, two outputs, droplets born at hits on a moving body.
-- Proves: no drop is in the body of the car, and the car carries droplets along (tests/blender/test_shots.py).
local rapid = require "rapid"

local rate = rapid.param("rate", 12000, "drops per second [0, 200000]")
local wind = rapid.param("wind", -1.5, "wind along the road, m/s [-20, 20]")
local count = rapid.param("droplets", 5, "droplets per hit [0, 50]")

local clouds = rapid.host "clouds"
local car = rapid.levelset.from_mesh(rapid.host "car", { voxel = 0.05 })
local road = rapid.shape.plane {}

local drops = rapid.create { seed = 5 }
  :emit    { source = clouds, rate = rate, velocity = {wind, -8, 0}, spread = 1, life = 3,
             attributes = { pscale = {0.006, 0.009}, Cd = {0.5, 0.65, 0.9} } }
  :gravity {}
  :collide { shape = car, response = "die" }
  :collide { shape = road, response = "die" }
  :solve   {}

local droplets = rapid.create { seed = 5 }
  :spawn   { from = drops, on = "hit", min_speed = 3, count = count, inherit_velocity = 0, speed = {0.5, 2},
             spread = 65, life = {0.15, 0.5}, attributes = { pscale = {0.003, 0.006}, Cd = {0.8, 0.87, 1} } }
  :gravity {}
  :wind    { velocity = {wind, 0, 0}, drag = 2 }
  :collide { shape = car, bounce = 0.1, friction = 0.4 }
  :collide { shape = road, response = "die" }
  :solve   {}

return { drops = drops, droplets = droplets }
