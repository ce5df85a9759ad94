-- trails: fragments of a blast bounce on the ground, and leave dust along their paths.
--
-- Shows:  continuous births from a chain that collides: the stream follows each bounce within the frame; source_group.
-- Proves: dust is born on the fragments' paths, never below the ground, and each emits as much as its rate says
--         (tests/graphs/test_trails.lua).
-- Run:    rapid run graphs/trails.lua -f 1-60 --camera 0,2.2,11,0,1.6,0 -o /tmp/trails.####.png
local rapid = require "rapid"

local dust_rate = rapid.param("dust", 420, "grains of dust per second and fragment")

local ground = rapid.shape.plane {}

local fragments = rapid.create { fps = 24, seed = 11 }
  :emit    { source = rapid.mesh.sphere { radius = 0.2, center = {0, 0.25, 0} }, impulse = { [2] = 40 },
             velocity = {0, 7.5, 0}, spread = 50, attributes = { pscale = 0.05, Cd = {0.32, 0.26, 0.22} } }
  :gravity {} :collide { shape = ground, bounce = 0.45, friction = 0.3 }
  :group   { name = "fast", where = function(p) return p.v:length() > 1.5 end }
  :solve   {}

local dust = rapid.create { fps = 24, seed = 11 }
  :spawn   { from = fragments, source_group = "fast", rate = dust_rate, inherit_velocity = 0.08,
             velocity = {0, 0.25, 0}, spread = 180, life = {0.5, 1.4}, attributes = { Cd = {0.85, 0.76, 0.62} } }
  :wind    { velocity = {0.5, 0.15, 0}, drag = 2 } :turbulence { amplitude = 1.2, size = 0.8, seed = 2 }
  :collide { shape = ground, bounce = 0 }
  :solve   {}

return dust:merge(fragments)
