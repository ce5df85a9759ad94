-- fade_by_age: changes an attribute from one value to another over each point's life.
--
--   a = first + (last - first) t            t = (age / life - hold) / (1 - hold), clamped to [0, 1]
--
-- The age is that at the frame's end, as it is written. A point that lives for ever keeps the first value.
local rapid = require "rapid"

return rapid.node {
  name = "fade_by_age",
  doc  = "Fades an attribute over the life of each point.",
  params = {
    attribute = { "write", default = "pscale", doc = "a float" },
    first     = { "float", default = 1, doc = "its value at birth" },
    last      = { "float", default = 0, doc = "its value at death" },
    hold      = { "float", default = 0, min = 0, max = 0.999, doc = "part of the life before the fade begins" },
  },
  points = function(p, _, params)
    local t = p.life > 0 and (p.age + p.dt) / p.life or 1
    p[params.attribute] = rapid.math.fit(t, params.hold, 1, params.first, params.last)
  end,
}
