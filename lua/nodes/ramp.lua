-- ramp: computes one attribute from another through keys, linearly between them.
--
-- A vec3 is looked up by its length. The keys' values are numbers or vec3s, matching the attribute that is written.
local rapid = require "rapid"

return rapid.node {
  name = "ramp",
  doc  = "Draws an attribute from another by way of keys.",
  params = {
    from = { "read", default = "age", doc = "the attribute that is looked up" },
    keys = { "ramp", default = {{0, {1, 1, 1}}, {1, {0, 0, 0}}}, doc = "{value of from, value of to}, rising" },
    to   = { "write", default = "Cd", doc = "the attribute that is written" },
  },
  points = function(p, _, params)
    local x = p[params.from]
    if type(x) ~= "number" then x = x:length() end
    p[params.to] = params.keys(x)
  end,
}
