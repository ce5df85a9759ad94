-- ash: glowing flakes are born in the smoke of a fire, which carries them along.
--
-- The smoke is a sequence of volumes, one for every 16th frame, written by graphs/smoke/smoke.lua. Density and velocity
-- are interpolated linearly between them.
--
-- Shows:  rapid.fog.read as a source, rapid.grid.read as the velocity of a flow, sequences with gaps.
-- Proves: flakes are born inside the smoke and move with it (tests/graphs/test_ash.lua).
-- Run:    rapid run graphs/ash.lua -f 1-96 -o /tmp/ash.mp4
local rapid = require "rapid"

local rate = rapid.param("rate", 5000, "flakes per second")
local files = rapid.param("smoke", "smoke/smoke.####.vdb", "a sequence with the grids density and v")
local first = rapid.param("first", 49, "the frame of the sequence that the scene begins with")

local function read(maker, grid) return maker(files, { grid = grid, offset = 1 - first, after = "repeat" }) end

return rapid.create { fps = 24, seed = 3 }
  :emit       { source = read(rapid.fog.read, "density"), rate = rate, life = {0.8, 2.4},
                attributes = { heat = {0.5, 1}, Cd = {1, 0.5, 0.1}, pscale = {0.003, 0.009} } }
  :field      { grid = read(rapid.grid.read, "v"), mode = "velocity", drag = 12 }
  :gravity    { g = {0, -1.2, 0} }
  :turbulence { amplitude = 9, size = 0.25, speed = 1 }
  :points     ("glow", function(p, frame)
      -- A flake turns, and flares up when it faces the viewer.
      local flare = 0.4 + 0.6 * math.abs(math.sin((3 + 6 * p:rand(1)) * frame.time + 6.28 * p:rand(2)))
      local heat = p.heat * (1 - p.nage) * flare
      p.Cd = vec3(1.6, 0.75 * heat + 0.15, 0.35 * heat * heat) * (0.08 + heat)
    end)
  :solve      { substeps = 2 }
  :picture    { blend = "add", shutter = 0.6, emitters = false,
                camera = rapid.camera { position = {0.3, 1.9, 5.6}, target = {0.3, 1.8, 0} } }
