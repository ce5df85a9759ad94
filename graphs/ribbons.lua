-- ribbons: lights circle the tip of a wand that is swung, and leave ribbons behind.
--
-- Shows:  :trail, drawn as lines that shine; a kernel that knows where the wand is.
-- Proves: a trail holds the positions of the previous frames, in order (tests/graphs/test_ribbons.lua).
-- Run:    rapid run graphs/ribbons.lua -f 1-96 -o /tmp/ribbons.mp4
local rapid = require "rapid"

local count = rapid.param("lights", 18, "around the tip")

-- The tip swings in a figure of eight.
local function tip(time)
  return vec3(1.5 * math.sin(1.7 * time), 1.2 + 0.5 * math.sin(3.4 * time), 0.6 * math.cos(1.7 * time))
end

local start = {}
for k = 1, count do start[k] = {0, 1.2, 0.6} end

return rapid.create { fps = 24, seed = 1, points = rapid.points.from { P = start } }
  :attribute { Cd = {0, 0, 0}, pscale = 0.004 }
  :trail     { places = 36 }
  :points    ("circle", function(p, frame)
      local part = p.id / count
      local angle = 6.28319 * part + (4 + 3 * part) * frame.time
      local wide = 0.12 + 0.1 * math.sin(2 * frame.time + 9 * part)
      local out = vec3(math.cos(angle), math.sin(angle), math.sin(angle + 1.5) * 0.7)
      p.v = (tip(frame.time) + out * wide - p.P) / frame.dt  -- solve moves it there
      p.Cd = vec3(0.9, 0.25, 0.1):lerp(vec3(0.1, 0.35, 1), part)
    end)
  :solve     {}
  :picture   { blend = "add", camera = rapid.camera { position = {0, 1.4, 3.9}, target = {0, 1.2, 0} } }
