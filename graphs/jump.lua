-- jump: a wet figure hops; drops tear off it, and splash where they hit the floor.
--
-- Shows:  births on a moving body, response = "stick" with adhesion, a second chain born at the hits of the first.
-- Proves: drops ride on the figure until it takes more than their adhesion; droplets begin on the floor
--         (tests/graphs/test_jump.lua).
-- Run:    rapid run graphs/jump.lua -f 1-96 -o /tmp/jump.mp4
local rapid = require "rapid"

local rate = rapid.param("rate", 3000, "drops per second on the figure")

local function ball(radius, x, y, z)
  return rapid.levelset.sphere { radius = radius, center = {x, y, z}, voxel = 0.02 }
end
local figure = ball(0.15, 0, 1.35, 0):union(ball(0.24, 0, 0.95, 0)):union(ball(0.2, 0, 0.68, 0))
for k = 0, 3 do -- arms up, legs apart
  for side = -1, 1, 2 do
    figure = figure:union(ball(0.075, side * (0.24 + 0.1 * k), 1.05 + 0.09 * k, 0))
      :union(ball(0.09, side * (0.12 + 0.05 * k), 0.52 - 0.13 * k, 0))
  end
end

-- One second in the air, and a quarter of a second on the ground.
local function hop(frame)
  local t = math.min(frame.time % 1.1, 0.85)
  return rapid.translate(0, 9.81 / 2 * t * (0.85 - t), 0) * rapid.rotate({0, 1, 0}, 150 * t)
end

local floor = rapid.shape.plane {}
local drops = rapid.create { fps = 24, seed = 4 }
  :emit    { source = figure:transform(hop), rate = rate, life = 6,
             attributes = { pscale = 0.009, Cd = {0.3, 0.6, 1} } }
  :gravity {}
  :collide { shape = figure, transform = hop, response = "stick", adhesion = 14 }
  :collide { shape = floor, response = "die" }
  :solve   { substeps = 3 }

local splash = rapid.create { fps = 24, seed = 4 }
  :spawn   { from = drops, on = "hit", min_speed = 2, count = 5, split = true, inherit_velocity = 0,
             speed = {0.8, 1.8}, spread = 60, life = 0.5, attributes = { Cd = {0.8, 0.92, 1} } }
  :gravity {} :collide { shape = floor, response = "die" } :solve {}

return splash:merge(drops)
  :picture { shutter = 0.5, emitters = false, camera = rapid.camera { position = {1, 1.6, 5.4}, target = {0, 1.2, 0} } }
