-- fade_by_age: bubbles shrink in the second half of their lives.
--
-- Shows:  :fade_by_age; the picture is frame 60.
-- Proves: tests/lua/nodes/test_fade_by_age.lua has its closed form.
-- Run:    rapid run graphs/nodes/fade_by_age.lua -f 60 --size 288x162 -o /tmp/fade_by_age.png
local rapid = require "rapid"

return rapid.create { fps = 24, seed = 3 }
  :emit        { source = rapid.mesh.grid { size = {1.6, 0.5} }, rate = 5000, velocity = {0, 1.2, 0}, spread = 10,
                 life = {1, 1.3}, attributes = { Cd = {0.5, 0.85, 1} } }
  :fade_by_age { attribute = "pscale", first = 0.016, last = 0, hold = 0.4 }
  :solve       {}
