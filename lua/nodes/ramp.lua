-- ramp: computes one attribute from another through keys, linearly between them.
--
-- A vec3 is looked up by its length. The keys' values are numbers or vec3s, matching the attribute that is written.
local rapid = require "rapid"

return rapid.node {
  name = "ramp",
  doc  = "Computes an attribute from another through a ramp of keys.",
  params = {
    from = { "read", default = "age", doc = "attribute that is looked up, a vec3 by its length" },
    keys = { "ramp", default = {{0, {1, 1, 1}}, {1, {0, 0, 0}}},
             doc = "keys {value of from, value of to}, in rising order" },
    to   = { "write", default = "Cd", doc = "attribute that is written" },
  },
  points = function(p, _, params)
    local x = p[params.from]
    if type(x) ~= "number" then x = x:length() end
    p[params.to] = params.keys(x)
  end,
}
