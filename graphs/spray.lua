-- spray: a fountain pulses; its drops patter over a ball and run off it across a wet floor.
--
-- Shows:  a parameter that is a function of the frame, the radius pscale in collisions, friction.
-- Proves: every drop keeps its radius from the ball and the floor (tests/graphs/test_spray.lua).
-- Run:    rapid run graphs/spray.lua -f 1-96 -o /tmp/spray.####.png
local rapid = require "rapid"

local rate = rapid.param("rate", 16000, "drops born per second when the pump pushes hardest")

local nozzle = rapid.mesh.grid { size = {0.16, 0.16}, center = {-1.1, 0.3, 0} }
local ball = rapid.levelset.sphere { radius = 0.5, center = {0.8, 0.5, 0}, voxel = 0.025 }

return rapid.create { fps = 24, seed = 11 }
  :emit    { source = nozzle, rate = function(frame) return rate * (0.55 + 0.45 * math.cos(9 * frame.time)) end,
             birth = "random", velocity = {2.1, 5.2, 0}, spread = 5, life = 2.5,
             attributes = { pscale = 0.008, Cd = {0.55, 0.8, 0.95} } }
  :gravity {}
  :collide { shape = ball, bounce = 0.15, friction = 0.05 }
  :collide { shape = rapid.shape.plane { normal = {0, 1, 0} }, bounce = 0.25, friction = 0.15 }
  :solve   {}
