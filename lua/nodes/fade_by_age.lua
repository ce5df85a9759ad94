-- fade_by_age: changes an attribute from one value to another over each point's life.
--
--   a = first + (last - first) t            t = (age / life - hold) / (1 - hold), clamped to [0, 1]
--
-- The age is that at the frame's end, as it is written. A point that lives for ever keeps the first value.
local rapid = require "rapid"

return rapid.node {
  name = "fade_by_age",
  doc  = "Changes an attribute over the life of each point.",
  params = {
    attribute = { "write_number", default = "pscale", doc = "float attribute that is written" },
    first     = { "float", default = 1, doc = "value at birth; for pscale a radius in metres" },
    last      = { "float", default = 0, doc = "value at death" },
    hold      = { "float", default = 0, min = 0, max = 0.999, doc = "fraction of the life before the change begins" },
  },
  points = function(p, _, params)
    local t = p.life > 0 and (p.age + p.dt) / p.life or 1
    p[params.attribute] = rapid.math.fit(t, params.hold, 1, params.first, params.last)
  end,
}
