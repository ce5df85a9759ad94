-- plume: hot dust rises from a ring; tests/view/screenshots looks at its files, without it.
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 5 }
  :emit { source = rapid.mesh.torus { radius = 0.5, tube = 0.1 }, rate = 20000, life = {0.5, 2}, speed = 0.6,
          attributes = { pscale = {0.004, 0.012}, temperature = {200, 900} } }
  :turbulence { amplitude = 4, size = 0.4 }
  :wind { velocity = {0, 1, 0}, drag = 2 }
  :solve {}
