-- Ramps: a number, or a vec3, by way of keys {position, value} between which it is linear; held at its ends.
--
-- A ramp is a function from generated text, a branch for each interval: compiled traces hold no loop and no table.
local vector = require "vec3"

local function literal(value)
  if type(value) == "number" then return ("%.17g"):format(value) end
  return ("vec3(%.17g, %.17g, %.17g)"):format(value.x, value.y, value.z)
end

-- keys: a list of {position, value}, which the host has checked: rising positions, values of one type.
local function make(keys)
  local text = { "local vec3 = ...", "return function(...)", "  local x = ...",
                 ("  if x <= %.17g then return %s end"):format(keys[1][1], literal(keys[1][2])) }
  for k = 2, #keys do
    local from, to = keys[k - 1], keys[k]
    text[#text + 1] = ("  if x < %.17g then return %s + %s * ((x - %.17g) / %.17g) end"):format(to[1],
      literal(from[2]), literal(to[2] - from[2]), from[1], to[1] - from[1])
  end
  text[#text + 1] = ("  return %s"):format(literal(keys[#keys][2]))
  text[#text + 1] = "end"
  return assert(loadstring(table.concat(text, "\n"), "=[rapid ramp]"))(vector.type)
end

return { make = make }
