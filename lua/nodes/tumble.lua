-- tumble: turns the `orient` of points by their own angular velocity `w`, which drag slows.
--
--   w' = -drag w            orient' = rotation(w, |w| (1 - e^(-drag dt)) / drag) orient: exact over the frame
--
-- This is for points that no :contact{ spin = true } turns. With a speed, points whose w is 0 get one about a random
-- axis, speed (1 + variation r) with their own r in [-1, 1].
local rapid = require "rapid"

local at_rest = 0.01 -- m/s
local least = 1e-6 -- rad/s; slower than that drag does not slow a point that was given a speed, or it would get another

return rapid.node {
  name = "tumble",
  doc  = "Turns orient by the angular velocity w of each point.",
  params = {
    drag         = { "float", default = 0, min = 0, unit = "1/s", doc = "rate at which w decreases" },
    speed        = { "float", default = 0, min = 0, unit = "deg/s",
                     doc = "angular speed of points whose w is 0, about a random axis" },
    variation    = { "float", default = 0, min = 0, max = 1, doc = "fraction of the speed by which points differ" },
    stop_at_rest = { "bool", default = false, doc = "stops turning points slower than 1 cm/s" },
  },
  makes = { orient = {0, 0, 0, 1}, w = {0, 0, 0} },
  points = function(p, _, params)
    if params.stop_at_rest and p.v:length() < at_rest then return end
    local w, k = p.w, params.drag * p.dt
    local rate = w:length()
    if rate == 0 then
      if params.speed == 0 then return end
      rate = math.rad(params.speed * (1 + params.variation * (2 * p:rand(3) - 1)))
      local z, angle = 2 * p:rand(1) - 1, 2 * math.pi * p:rand(2)
      local r = math.sqrt(1 - z * z)
      w = vec3(r * math.cos(angle), r * math.sin(angle), z) * rate
    end
    local left = math.exp(-k)
    local time = k > 1e-6 and p.dt * (1 - left) / k or p.dt
    p.orient = (rapid.math.rotation(w, math.deg(rate * time)) * p.orient):normalized()
    p.w = params.speed > 0 and rate * left < least and w or w * left
  end,
}
