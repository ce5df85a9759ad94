-- dissolve: a chess piece crumbles into the wind, in the order that is painted on it.
--
-- Shows:  births with the colours of a mesh's vertices; a group that gains members; forces on one group only.
-- Proves: no point moves before its colour allows, and all whose time has come have moved
--         (tests/graphs/test_dissolve.lua).
-- Run:    rapid run graphs/dissolve.lua -f 1-120 -o /tmp/dissolve.mp4
local rapid = require "rapid"

local count = rapid.param("count", 60000, "points")
local duration = rapid.param("duration", 3, "seconds in which it goes")

-- A pawn, turned from its outline {radius, height}; red is painted from 0 (goes first) to 1.
local outline = {
  {0, 0}, {0.42, 0}, {0.44, 0.1}, {0.36, 0.18}, {0.36, 0.24}, {0.24, 0.36}, {0.17, 0.6}, {0.15, 0.84}, {0.3, 0.9},
  {0.3, 0.95}, {0.16, 1}, {0.24, 1.09}, {0.27, 1.2}, {0.24, 1.31}, {0.15, 1.41}, {0, 1.45},
}
local points, colours, faces, sides = {}, {}, {}, 48
for row, at in ipairs(outline) do
  for k = 0, sides - 1 do
    local angle = 2 * math.pi * k / sides
    local P = vec3(at[1] * math.cos(angle), at[2], at[1] * math.sin(angle))
    local order = rapid.math.clamp(0.85 - 0.5 * P.y + 0.25 * P.x + 0.3 * rapid.math.noise(P * 3, 0, 2), 0.05, 1)
    points[#points + 1], colours[#colours + 1] = P, {order, 0.3, 0.5 - 0.4 * order}
    local low, high, next = (row - 1) * sides, row * sides, (k + 1) % sides
    if row < #outline then faces[#faces + 1] = {low + k + 1, high + k + 1, high + next + 1, low + next + 1} end
  end
end
local pawn = rapid.mesh.from { points = points, faces = faces, values = { Cd = colours } }

return rapid.create { fps = 24, seed = 21 }
  :emit       { source = pawn, impulse = { [1] = count }, attributes = { pscale = 0.009 } }
  :points     ("crumble", function(p, frame)
      if p:within "loose" then
        p.Cd, p.pscale = p.Cd:lerp(vec3(1, 0.75, 0.4), 2 * p.dt), 0.009 * math.sqrt(math.min(1, p.life - p.age))
      elseif frame.time >= p.Cd.x * duration then
        p:join "loose"
        p.life = p.age + 1 + p:rand(1)
      end
    end)
  :wind       { group = "loose", velocity = {1.3, 0.5, 0}, drag = 2 }
  :turbulence { group = "loose", amplitude = 5, size = 0.5, speed = 0.5 }
  :solve      {}
  :picture    { shutter = 0.4, emitters = false,
                camera = rapid.camera { position = {0.9, 1, 4.2}, target = {0.9, 0.85, 0} } }
