-- comet: an emitter that turns by 60 degrees a frame, with its motion as a spline, as straight lines, and with none.
--
-- Its points stay where they are born, so they draw the path that it is assumed to take.
--
-- Shows:  a moving source, and motion = "spline" (left), "linear" (middle), "none" (right).
-- Proves: the spline's points lie within 3 % of the circle's radius of it, without a gap between frames; those of the
--         lines lie on its chords, and those without motion at 24 places a second (tests/graphs/test_comet.lua).
-- Run:    rapid run graphs/comet.lua -f 1-14 --camera 2.6,0,7.6,2.6,0,0 -o /tmp/comet.####.png
local rapid = require "rapid"

local turn = rapid.param("turn", 60, "degrees a frame")

local scene = rapid.create { fps = 24, seed = 9 }
for k, motion in ipairs { "spline", "linear", "none" } do
  local function place(frame)
    return rapid.translate(2.6 * (k - 1), 0, 0) * rapid.rotate({0, 0, 1}, turn * 24 * frame.time)
      * rapid.translate(1, 0, 0)
  end
  scene = scene:emit {
    name = motion, source = rapid.mesh.sphere { radius = 0.02 }:transform(place), motion = motion, birth = "even",
    rate = 24000, inherit_velocity = 0, life = 5 / 24, attributes = { Cd = {1, 0.75 - 0.2 * k, 0.2 * k} },
  }
end
return scene:solve {}
