-- dust: a boulder breaks, and every piece drags a plume of dust along.
--
-- Shows:  births all the time along the paths of other points, by an attribute of theirs; Alpha that fades with age.
-- Proves: dust is born on the paths of the pieces, without gaps, and only as long as they fly
--         (tests/graphs/test_dust.lua).
-- Run:    rapid run graphs/dust.lua -f 1-72 -o /tmp/dust.mp4
local rapid = require "rapid"

local count = rapid.param("pieces", 45, "pieces of the boulder")

local pieces = rapid.create { fps = 24, seed = 6 }
  :emit    { source = rapid.shape.sphere { radius = 0.25, center = {0, 0.3, 0} }, from = "volume",
             impulse = { [2] = count }, age = 0, velocity = {0, 5.2, 0}, spread = 55,
             attributes = { pscale = {0.02, 0.06}, dust = 0, Cd = {0.3, 0.24, 0.2} } }
  :points  ("shed", function(p) p.dust = p.v:length() > 0.8 and 160 * p.v:length() or 0 end)
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0.35, friction = 0.5 }
  :solve   {}

local dust = rapid.create { fps = 24, seed = 6 }
  :spawn      { from = pieces, rate = rapid.attr "dust", inherit_velocity = 0.25, velocity = {0, 0.25, 0},
                spread = 180, life = {0.8, 1.8}, attributes = { pscale = 0.02, Alpha = 0, Cd = {0.62, 0.52, 0.42} } }
  :drag       { linear = 4 }
  :turbulence { amplitude = 3, size = 0.3, speed = 0.5 }
  :collide    { shape = rapid.shape.plane {}, bounce = 0, friction = 1 }
  :points     ("spread", function(p)
      p.pscale = 0.008 + 0.09 * math.sqrt(p.nage)
      p.Alpha = 0.06 * (1 - p.nage) ^ 1.5
    end)
  :solve      {}

return dust:merge(pieces)
  :picture { shutter = 0.5, emitters = false,
             camera = rapid.camera { position = {1.6, 1.4, 5.8}, target = {0, 0.75, 0} } }
