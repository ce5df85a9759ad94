-- mill: grain falls on a turning cross of paddles, is thrown off, and drifts away in the wind.
--
-- Shows:  a collider that moves (transform, a function of the frame that is also evaluated between frames), forces, an
--         action inside the solver, and a tolerance instead of a number of sub-steps.
-- Proves: no grain is inside a paddle or below the floor, and the error of each frame meets the tolerance
--         (tests/graphs/test_mill.lua).
-- Run:    rapid run graphs/mill.lua -f 1-96 -o /tmp/mill.####.png
local rapid = require "rapid"

local rate = rapid.param("rate", 5000, "grains born per second")
local speed = rapid.param("speed", 120, "degrees a second")

local paddles = rapid.levelset.box { size = {1.6, 0.15, 0.8}, voxel = 0.025 }
  :union(rapid.levelset.box { size = {0.15, 1.6, 0.8}, voxel = 0.025 })

local function turning(frame)
  return rapid.translate(0, 1.1, 0) * rapid.rotate({0, 0, 1}, -speed * frame.time)
end

return rapid.create { fps = 24, seed = 5 }
  :emit    { source = rapid.mesh.box { size = {0.7, 0.05, 0.5}, center = {0.25, 2.4, 0} }, rate = rate, life = 3,
             velocity = {0, -1, 0}, spread = 8, attributes = { Cd = {0.95, 0.8, 0.35} } }
  -- Runs inside Solve, at every sub-step: grain that is thrown high glows with its speed.
  :action  ("glow", function(p, step)
      p.Cd = p.Cd:lerp(p.v:length() > 4 and vec3(1, 0.35, 0.1) or vec3(0.95, 0.8, 0.35), 4 * step.dt)
    end)
  :gravity {}
  :wind    { velocity = {3, 0, 0}, drag = 0.3 }
  :turbulence { amplitude = 2, size = 0.8, speed = 0.5 }
  :collide { shape = paddles, transform = turning, bounce = 0.3, friction = 0.3 }
  :collide { shape = rapid.shape.plane {}, bounce = 0.2, friction = 0.4 }
  :solve   { tolerance = 1e-3 }
