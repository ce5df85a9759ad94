-- torque: light balls spin up sooner than heavy ones; the faster they turn, the brighter they are.
--
-- Shows:  :torque; the picture is frame 30.
-- Proves: tests/lua/nodes/test_torque.lua has its closed form.
-- Run:    rapid run graphs/nodes/torque.lua -f 30 --size 288x162 -o /tmp/torque.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3, points = rapid.points.grid { size = {3, 0.05, 3}, spacing = 0.04 } }
  :attribute { Cd = {1, 1, 1}, pscale = 0.02, mass = 1 }
  :points    ("weigh", function(p) p.mass = 0.4 + 0.6 * (p.P.x + 1.5) end)
  :torque    { torque = {4e-4, 0, 0} }
  :points    ("show", function(p)
      p.Cd = vec3(0.02, 0.03, 0.1):lerp(vec3(0.5, 0.85, 1), math.min(p.w:length() / 7, 1) ^ 2)
    end)
  :solve     {}
