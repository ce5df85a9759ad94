-- first: water-blue beads pour out of a ring, are turned by a wind that exists only in Lua, and bounce down a torus to
-- the floor.
--
-- Shows:  the four nodes of every simulation (create, emit, collide, solve) and a Lua node between them.
-- Proves: no bead is inside the torus or below the floor at any frame (tests/graphs/test_first.lua).
-- Run:    rapid run graphs/first.lua -f 1-96 -o /tmp/first.####.png
local rapid = require "rapid"

local rate = rapid.param("rate", 20000, "particles born per second")

local ring = rapid.mesh.torus { radius = 0.35, tube = 0.06, center = {0, 2.2, 0} }
local body = rapid.mesh.torus { radius = 0.6, tube = 0.22, divisions = 64, center = {0, 0.7, 0} }
local floor = rapid.shape.plane { normal = {0, 1, 0} }

local up = vec3(0, 1, 0)

return rapid.create { fps = 24, seed = 7 }
  :emit    { source = ring, rate = rate, birth = "random", life = {2.5, 3.5}, velocity = {0, -0.5, 0}, spread = 15,
             attributes = { Cd = {0.25, 0.6, 1} } }
  :points  ("swirl", function(p)
      -- p.dt is the time that this point moves in this frame: a newborn's is shorter.
      p.v = p.v + up:cross(p.P) * (3 * p.dt)
      if p.age > 1.5 then p.Cd = p.Cd:lerp(vec3(1, 0.45, 0.2), 2 * p.dt) end
    end)
  :gravity {}
  :collide { shape = rapid.levelset.from_mesh(body, { voxel = 0.02 }), bounce = 0.4, friction = 0.2 }
  :collide { shape = floor, bounce = 0.3, friction = 0.3 }
  :solve   { substeps = 1 }
