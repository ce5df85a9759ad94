-- wrap: snow falls for ever through a box of air.
--
-- Shows:  :wrap; the picture is frame 48.
-- Proves: tests/lua/nodes/test_wrap.lua has its closed form.
-- Run:    rapid run graphs/nodes/wrap.lua -f 48 --size 288x162 -o /tmp/wrap.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3,
    points = rapid.points.grid { size = {3, 1.5, 1.5}, spacing = 0.1 } }
  :attribute { Cd = {0.9, 0.95, 1}, pscale = 0.008 }
  :points    ("fall", function(p) p.v = rapid.math.curl_noise(p.P, 0, 3) * 0.5 - vec3(0, 0.7, 0) end)
  :wrap      { min = {-1.5, -0.75, -0.75}, max = {1.5, 0.75, 0.75} }
  :solve     {}
