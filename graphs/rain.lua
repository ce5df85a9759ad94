-- rain: rain falls on an umbrella, runs down and drips from the rim, until the umbrella is twirled.
--
-- Shows:  response = "slide" with viscosity and adhesion on a rotating body; droplets born at hits.
-- Proves: drops run down the canopy at g sin a / viscosity, and leave the rim when it is twirled
--         (tests/graphs/test_rain.lua).
-- Run:    rapid run graphs/rain.lua -f 1-120 -o /tmp/rain.mp4
local rapid = require "rapid"

local rate = rapid.param("rate", 9000, "drops per second")
local viscosity = rapid.param("viscosity", 16, "of drops on the canopy, 1/s")

-- A cap of a ball of radius 1.1 m, with its rim at a height of 1.28 m, and a stick.
local canopy = rapid.levelset.sphere { radius = 1.1, center = {0, 0.7, 0}, voxel = 0.02 }
  :subtract(rapid.levelset.sphere { radius = 1.04, center = {0, 0.7, 0}, voxel = 0.02 })
  :intersect(rapid.levelset.box { size = {3, 1, 3}, center = {0, 1.78, 0}, voxel = 0.02 })
  :union(rapid.levelset.box { size = {0.05, 1.7, 0.05}, center = {0, 1, 0}, voxel = 0.02 })
for k = 0, 7 do -- a bight between each two ribs
  local middle = {1.05 * math.cos(k * math.pi / 4), 1.18, 1.05 * math.sin(k * math.pi / 4)}
  canopy = canopy:subtract(rapid.levelset.sphere { radius = 0.32, center = middle, voxel = 0.02 })
end

-- The umbrella makes four turns, from 2.5 s to 4.5 s.
local function twirl(frame)
  return rapid.rotate({0, 1, 0}, 1440 * rapid.math.smoothstep(2.5, 4.5, frame.time))
end

local ground = rapid.shape.plane {}
local rain = rapid.create { fps = 24, seed = 5 }
  :emit    { source = rapid.mesh.grid { size = {5, 4}, center = {-0.3, 3.6, 0} }, rate = rate, velocity = {0.6, -7, 0},
             spread = 1, life = 5, attributes = { pscale = {0.006, 0.011}, Cd = {0.4, 0.62, 0.9} } }
  :gravity {}
  :collide { shape = canopy, transform = twirl, response = "slide", viscosity = viscosity, adhesion = 14 }
  :collide { shape = ground, response = "die" }
  :solve   { substeps = 2 }

local splash = rapid.create { fps = 24, seed = 5 }
  :spawn   { from = rain, on = "hit", min_speed = 3, count = 3, inherit_velocity = 0, speed = {0.5, 1.4}, spread = 65,
             life = {0.1, 0.3}, attributes = { pscale = 0.004, Alpha = 0.5, Cd = {0.5, 0.62, 0.75} } }
  :gravity {} :collide { shape = ground, response = "die" } :solve {}

return splash:merge(rain)
  :picture { shutter = 0.4, emitters = false, camera = rapid.camera { position = {1, 2.5, 5}, target = {0, 1.15, 0} } }
