-- tide: a million points on a swell; for the viewer's pictures (tests/view/screenshots).
local rapid = require "rapid"

local side = rapid.param("side", 1000, "points along each edge of the sea")
local height = rapid.param("height", 0.25, "of the swell, m")
local calm = rapid.param("calm", false, "no swell at all")
local wind = rapid.param("wind", {1.5, 0, 0.4}, "over the sea, m/s")

local P = {}
for i = 0, side * side - 1 do P[i + 1] = {i % side / side * 8 - 4, 1, math.floor(i / side) / side * 8 - 4} end

return rapid.create { fps = 24, points = rapid.points.from { P = P } }
  :attribute { pscale = 0.004, foam = 0 }
  :points("swell", function(p, frame)
    local y = calm and 0 or height * (math.sin(2 * p.P.x + 3 * frame.time) + math.sin(1.3 * p.P.z + 2 * frame.time))
    p.v = p.v + vec3(0, (y + 0.8 - p.P.y) * 0.6, 0)
    p.foam = math.max(0, y)
  end)
  :group { name = "crest", where = function(p) return p.foam > 0.35 end }
  :wind { velocity = wind, drag = 0.4 }
  :solve {}
