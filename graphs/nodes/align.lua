-- align: a field of scales stands up as a wave of normals passes: bright where they face the viewer.
--
-- Shows:  :align; the picture is frame 30.
-- Proves: tests/lua/nodes/test_align.lua: the axis points along the attribute, and gets there in time.
-- Run:    rapid run graphs/nodes/align.lua -f 30 --size 288x162 -o /tmp/align.png
local rapid = require "rapid"

return rapid.create { fps = 24, points = rapid.points.grid { size = {3, 0.05, 3}, spacing = 0.04 } }
  :attribute { Cd = {1, 1, 1}, N = {0, 1, 0}, pscale = 0.02 }
  :points    ("wave", function(p, frame)
      local slope = math.sin(3 * p.P:length() - 6 * frame.time)
      p.N = vec3(p.P.x, 0, p.P.z) * slope + vec3(0, 1, 0)
    end)
  :align     { to = "N", response = 0.1 }
  :points    ("show", function(p)
      local lit = p.orient:rotate(vec3(0, 1, 0)):dot(vec3(0.48, 0.6, 0.64))
      p.Cd = vec3(0.05, 0.2, 0.15):lerp(vec3(0.5, 1, 0.7), math.max(lit, 0))
    end)
  :solve     {}
