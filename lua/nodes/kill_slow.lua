-- kill_slow: removes points that have come to rest, so that a heap of debris costs nothing.
--
-- The test precedes the frame's motion: the speed is that at the end of the previous frame.
local rapid = require "rapid"

return rapid.node {
  name = "kill_slow",
  doc  = "Removes points that move too slowly.",
  params = {
    speed = { "float", default = 0.05, min = 0, unit = "m/s", doc = "speed below which points are removed" },
    age   = { "float", default = 0, min = 0, unit = "s", doc = "age below which points stay" },
  },
  points = function(p, _, params)
    if p.age >= params.age and p.v:length() < params.speed then p:kill() end
  end,
}
