-- sparks: a grinding wheel throws sparks that bounce on the floor and cool from white to red as they die.
--
-- Shows:  birth = "even", a Lua node from lua/nodes between Emit and Collide, colour from an attribute.
-- Proves: no spark is below the floor at any frame (tests/graphs/test_sparks.lua).
-- Run:    rapid run graphs/sparks.lua -f 1-96 -o /tmp/sparks.####.png
local rapid = require "rapid"

local rate = rapid.param("rate", 6000, "sparks born per second")

local wheel = rapid.mesh.torus { radius = 0.2, tube = 0.02, center = {0, 0.6, 0} }
local white, yellow, red = vec3(1, 0.95, 0.8), vec3(1, 0.6, 0.15), vec3(0.5, 0.08, 0.03)

return rapid.create { fps = 24, seed = 7 }
  :emit    { source = wheel, rate = rate, birth = "even", velocity = {5, 2.5, 0}, speed = 1.5, spread = 14,
             life = {0.4, 1.6}, attributes = { heat = 1, Cd = {1, 0.95, 0.8} } }
  :lift    { strength = 3, cooling = 0.4 }
  :points  ("glow", function(p)
      local heat = p.heat
      p.Cd = heat > 0.5 and yellow:lerp(white, 2 * heat - 1) or red:lerp(yellow, 2 * heat)
    end)
  :gravity {}
  :collide { shape = rapid.shape.plane { normal = {0, 1, 0} }, bounce = 0.35, friction = 0.2 }
  :solve   {}
