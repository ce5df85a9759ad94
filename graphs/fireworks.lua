-- fireworks: shells rise, burst at the top into stars, and stars draw trails of sparks.
--
-- Each generation is a chain of its own, spawned from the previous chain: a burst is at the place and time of a shell's
-- end, within the frame, and trails are continuous streams along the stars' paths.
--
-- Shows:  :spawn, on = "death", a rate for each parent, inherit.
-- Proves: a star is born where its shell ends, on its parabola; the sparks of a star are on its path at even times
--         (tests/graphs/test_fireworks.lua).
-- Run:    rapid run graphs/fireworks.lua -f 1-96 --camera 0,9,25,0,8.6,0 -o /tmp/fireworks.####.png
local rapid = require "rapid"

local stars_of_shell = rapid.param("stars", 160, "stars of a shell")

local mortars = rapid.points.from {
  P  = { {-6, 0, 0}, {0, 0, -3}, {6, 0, 1}, {-2, 0, 2} },
  v  = { {-0.8, 15.5, 0}, {0, 17.5, 0}, {1, 16, 0}, {0.4, 13, 0} },
  life = { 1.5, 1.75, 1.6, 1.3 },
  Cd = { {1, 0.45, 0.2}, {0.5, 0.8, 1}, {0.55, 1, 0.4}, {1, 0.6, 0.9} },
}

local shells = rapid.create { fps = 24, seed = 4, points = mortars }
  :gravity {} :solve {}

local stars = rapid.create { fps = 24, seed = 4 }
  :spawn   { from = shells, on = "death", count = stars_of_shell, inherit = { "Cd" }, inherit_velocity = 0.3,
             velocity = {0, 6.5, 0}, spread = 180, life = {1.1, 1.7} }
  :gravity {} :drag { linear = 0.9 } :solve {}

local sparks = rapid.create { fps = 24, seed = 4 }
  :spawn   { from = stars, rate = 160, birth = "even", inherit = { "Cd" }, inherit_velocity = 0.1,
             life = {0.2, 0.7} }
  :points  ("cool", function(p) p.Cd = p.Cd * (1 - 1.2 * p.dt) end)
  :gravity {} :drag { linear = 3 } :solve {}

return sparks:merge(stars, shells)
