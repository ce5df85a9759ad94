-- jitter: a drop of ink spreads as its grains are kicked about.
--
-- Shows:  :jitter; the picture is frame 36.
-- Proves: tests/lua/nodes/test_jitter.lua has its closed form.
-- Run:    rapid run graphs/nodes/jitter.lua -f 36 --size 288x162 -o /tmp/jitter.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3,
    points = rapid.points.grid { size = {0.3, 0.3, 0.3}, spacing = 0.0125 } }
  :attribute { Cd = {0.15, 0.35, 0.9}, pscale = 0.006 }
  :jitter    { strength = 0.6 }
  :solve     {}
