-- randomize: each point has its own number, the same in every frame.
--
--   a = min + (max - min) r^bias            r: uniform in [0, 1);  bias above 1 makes small numbers more frequent
local rapid = require "rapid"

return rapid.node {
  name = "randomize",
  doc  = "Gives each point its own random value of an attribute.",
  params = {
    attribute = { "write_number", default = "pscale", doc = "float attribute that is written" },
    min       = { "float", default = 0, doc = "smallest value" },
    max       = { "float", default = 1, doc = "largest value" },
    bias      = { "float", default = 1, min = 1e-3,
                  doc = "exponent of the distribution: 1 is uniform, larger values favour min" },
  },
  points = function(p, _, params)
    p[params.attribute] = params.min + (params.max - params.min) * p:rand(1) ^ params.bias
  end,
}
