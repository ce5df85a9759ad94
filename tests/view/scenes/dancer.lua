-- dancer: a deforming body sheds glitter; for the viewer's pictures (tests/view/screenshots).
local rapid = require "rapid"

local body = rapid.mesh.read(rapid.param("body", "jumper.####.ply", "its meshes"))
local rate = rapid.param("rate", 9000, "glitter a second")

return rapid.create { fps = 24, seed = 9 }
  :emit { source = body, rate = rate, life = {0.8, 2.4}, speed = 0.4, spread = 60,
          attributes = { pscale = {0.006, 0.014}, Cd = {1, 0.75, 0.3} } }
  :gravity {}
  :wind { velocity = {0, 0.2, 0}, drag = 1.5 }
  :turbulence { amplitude = 2, size = 0.6 }
  :collide { name = "body", shape = rapid.levelset.from_mesh(body, { voxel = 0.03 }), bounce = 0.2, friction = 0.3 }
  :collide { name = "floor", shape = rapid.shape.plane {}, bounce = 0.3, friction = 0.5 }
  :solve {}
