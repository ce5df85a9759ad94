-- math.sin, math.cos and math.exp, by runtime/elementary.h: the same bits on any processor, and for kernels of one
-- point and of many. They take the place of Lua's own before any other file is read.
--
-- Vararg for the reason that vec3.lua gives.
local ffi = require "ffi"

local type = type

-- functions: light userdata of double (*)(double), by name; library: the table `math`.
local function replace(functions, library)
  for name, address in pairs(functions) do
    local own, of_lua = ffi.cast("double (*)(double)", address), library[name]
    library[name] = function(...)
      local x = ...
      if type(x) ~= "number" then x = of_lua(...) and tonumber(x) end -- a text that is a number; or Lua's error
      local y = own(x)
      return y
    end
  end
end

return { replace = replace }
