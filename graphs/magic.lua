-- magic: two wands draw rings of light that wind around each other and scatter when they grow old.
--
-- Shows:  emission from points, two emitters in one chain, groups that a kernel joins, and edits of one group only.
-- Proves: a point is in "loose" exactly when it is older than 0.9 s (tests/graphs/test_magic.lua).
-- Run:    rapid run graphs/magic.lua -f 1-96 -o /tmp/magic.####.png
local rapid = require "rapid"

local rate = rapid.param("rate", 6000, "lights born per second at each wand")
local turn = rapid.param("turn", 5, "radians a second about the axis")

-- Twelve points on a circle, each with its own velocity that its children inherit.
local function wand(radius, height, lift)
  local places, velocities = {}, {}
  for k = 1, 12 do
    local angle = k * math.pi / 6
    places[k] = {radius * math.cos(angle), height, radius * math.sin(angle)}
    velocities[k] = {0, lift, 0}
  end
  return rapid.points.from { P = places, v = velocities }
end

return rapid.create { fps = 24, seed = 5 }
  :emit    { source = wand(0.7, 0.1, 1.1), rate = rate, birth = "even", life = {1.2, 2}, speed = 0, spread = 0,
             attributes = { Cd = {0.35, 0.55, 1} } }
  :emit    { source = wand(0.35, 2.3, -1.1), rate = rate, birth = "even", life = {1.2, 2},
             attributes = { Cd = {1, 0.4, 0.8} } }
  :points  ("wind", function(p)
      -- Turns the position about the y axis, and contracts the ring.
      local P, angle = p.P, turn * p.dt
      local c, s = math.cos(angle), math.sin(angle)
      local pull = math.exp(-0.35 * p.dt)
      p.P = vec3((c * P.x + s * P.z) * pull, P.y, (c * P.z - s * P.x) * pull)
      if p.age > 0.9 then p:join "loose" end
    end)
  :points  { name = "scatter", group = "loose", kernel = function(p, frame)
      local kick = vec3(p:rand(1, frame) - 0.5, p:rand(2, frame) - 0.5, p:rand(3, frame) - 0.5)
      p.v = p.v + kick * (14 * p.dt)
    end }
  :solve   {}
