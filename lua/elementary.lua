-- Rapid's own functions of `math`. Their results are bit-identical on any processor, interpreted, compiled and in
-- lanes. They replace LuaJIT's before any other file is read.
--
-- LuaJIT's interpreter and its compiled code give different results for squares, for ceil between -1 and -0.5, and for
-- min and max of NaN or of zeros of both signs. The C library's functions differ between its versions, and between
-- processors with and without fused multiplication.
--
-- The functions are vararg for the reason given in vec3.lua.
local ffi = require "ffi"

local floor, select, tonumber, type = math.floor, select, tonumber, type

-- Returns an argument as a number; a string may be one. Raises Lua's error otherwise.
local function number_in(name, place, ...)
  local value = select(place, ...)
  local kind = place > select("#", ...) and "no value" or type(value)
  local number = (kind == "number" or kind == "string") and tonumber(value)
  if number then return number end
  error(("bad argument #%d to '%s' (number expected, got %s)"):format(place, name, kind), 3)
end

local function of_one(name, own)
  return function(...)
    local x = ...
    if type(x) ~= "number" then x = number_in(name, 1, ...) end
    local y = own(x)
    return y
  end
end

local function of_two(name, own)
  return function(...)
    local x, y = ...
    if type(x) ~= "number" or type(y) ~= "number" then x, y = number_in(name, 1, ...), number_in(name, 2, ...) end
    local z = own(x, y)
    return z
  end
end

-- Returns math.log, with or without a base.
local function logarithm(own, own_of_base)
  return function(...)
    local x, base = ...
    if type(x) ~= "number" then x = number_in("log", 1, ...) end
    if select("#", ...) > 1 then
      if type(base) ~= "number" then base = number_in("log", 2, ...) end
      local y = own_of_base(x, base)
      return y
    end
    local y = own(x)
    return y
  end
end

-- Returns math.min or math.max: NaN if one of the numbers is NaN, and zeros become +0. In these cases LuaJIT's own
-- functions return the second operand, and compiled code swaps operands.
local function extreme(name, of_lua)
  local function any_number(...)
    local x, y = ...
    local count = select("#", ...)
    if type(x) ~= "number" then x = number_in(name, 1, ...) end
    if count < 2 then
      y = x
    elseif type(y) ~= "number" then
      y = number_in(name, 2, ...)
    end
    if x ~= x or y ~= y then x = x + y else x = of_lua(x, y) + 0 end
    if count > 2 then x = any_number(x, select(3, ...)) end
    return x
  end
  return any_number
end

local function ceiling(...)
  local x = ...
  if type(x) ~= "number" then x = number_in("ceil", 1, ...) end
  return -floor(-x)
end

-- Returns math.pow, which is also the operator ^ with its errors (lua/power_operator.lua).
local function power(own)
  return function(...)
    local x, y = ...
    if type(x) ~= "number" or type(y) ~= "number" then
      if type(x) == "string" then x = tonumber(x) or x end
      if type(y) == "string" then y = tonumber(y) or y end
      local wrong = x
      if type(x) == "number" then wrong = y end
      if type(wrong) == "table" or type(wrong) == "cdata" then return (x ^ y) end -- handled by its metatable
      if type(wrong) ~= "number" then
        error(("attempt to perform arithmetic on a %s value"):format(type(wrong)), 2)
      end
    end
    if y == 2 then return x * x end
    local z = own(x, y)
    return z
  end
end

-- Replaces functions in `library`, the table `math`. functions1, functions2: light userdata of double (*)(double) and
-- of double (*)(double, double), by their names in Lua.
local function replace(functions1, functions2, library)
  local own = {}
  for name, address in pairs(functions2) do
    own[name] = ffi.cast("double (*)(double, double)", address)
    library[name] = of_two(name, own[name])
  end
  for name, address in pairs(functions1) do
    local f = ffi.cast("double (*)(double)", address)
    library[name] = name == "log" and logarithm(f, own.log) or of_one(name, f)
  end
  library.min, library.max = extreme("min", library.min), extreme("max", library.max)
  library.ceil, library.pow = ceiling, power(own.pow)
end

return { replace = replace }
