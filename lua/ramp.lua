-- Ramps: numbers or vec3 values, linear between keys {position, value}, and constant beyond the first and the last.
--
-- A ramp is a function from generated text, with a branch for each interval, so that compiled traces have no loop and
-- no table.
local vector = require "vec3"

jit.off(true, true) -- this file, but not the functions that it makes

local format = string.format

local function literal(value)
  if type(value) == "number" then return format("%.17g", value) end
  return format("vec3(%.17g, %.17g, %.17g)", value.x, value.y, value.z)
end

-- Ramps by their text. A kernel gets its ramp once per frame; a new function each time would invalidate traces.
local made, count = {}, 0
local most = 1000 -- cached; a ramp that is a function of the frame may differ in each

-- keys: a list of {position, value}, checked by the host: rising positions, values of one type.
local function make(keys)
  local text = { "local vec3 = ...", "return function(...)", "  local x = ...",
                 format("  if x <= %.17g then return %s end", keys[1][1], literal(keys[1][2])) }
  for k = 2, #keys do
    local from, to = keys[k - 1], keys[k]
    text[#text + 1] = format("  if x < %.17g then return %s + %s * ((x - %.17g) / %.17g) end", to[1],
      literal(from[2]), literal(to[2] - from[2]), from[1], to[1] - from[1])
  end
  text[#text + 1] = format("  return %s", literal(keys[#keys][2]))
  text[#text + 1] = "end"

  local whole = table.concat(text, "\n")
  if not made[whole] then
    if count == most then made, count = {}, 0 end
    made[whole], count = assert(loadstring(whole, "=[rapid ramp]"))(vector.type), count + 1
  end
  return made[whole]
end

return { make = make }
