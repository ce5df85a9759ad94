-- tumble: turns the `orient` of points by their own angular velocity `w`, which drag slows.
--
--   w' = -drag w            orient' = rotation(w, |w| (1 - e^(-drag dt)) / drag) orient: exact over the frame
--
-- This is for points that no :contact{ spin = true } turns.
local rapid = require "rapid"

return rapid.node {
  name = "tumble",
  doc  = "Turns orient by the angular velocity w of each point.",
  params = {
    drag = { "float", default = 0, min = 0, unit = "1/s", doc = "rate at which w decreases" },
  },
  makes = { orient = {0, 0, 0, 1}, w = {0, 0, 0} },
  points = function(p, _, params)
    local w, k = p.w, params.drag * p.dt
    local rate = w:length()
    if rate == 0 then return end
    local left = math.exp(-k)
    local time = k > 1e-6 and p.dt * (1 - left) / k or p.dt
    p.orient = (rapid.math.rotation(w, math.deg(rate * time)) * p.orient):normalized()
    p.w = w * left
  end,
}
