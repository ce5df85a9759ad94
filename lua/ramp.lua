-- Ramps: numbers or vec3 values, linear between keys {position, value}, and constant beyond the first and the last.
--
-- A ramp is a function from generated text, with a branch for each interval: compiled traces have no loop and no table.
local vector = require "vec3"

jit.off(true, true) -- all of this file, but not the functions that it makes

local format = string.format

local function literal(value)
  if type(value) == "number" then return format("%.17g", value) end
  return format("vec3(%.17g, %.17g, %.17g)", value.x, value.y, value.z)
end

-- By text: a kernel gets its ramp once a frame; if it were a new function each time, traces would not last.
local made, count = {}, 0
local most = 1000 -- kept; a ramp that is a function of the frame may be another one in each

-- keys: a list of {position, value}, which the host has checked: rising positions, values of one type.
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
