-- What kernels and graph code ask of a shape or a level set:
--
--   shape:distance(P)    m, negative inside; beyond a level set's band a bound of the right sign
--   shape:gradient(P)    a vec3 out of the shape, of length 1 where the distance is exact; zero where there is none
--
-- An object's pointer is asked of the host once, and then found in a table, which compiled traces can do. The functions
-- are vararg for the reason that vec3.lua gives.
local ffi = require "ffi"
local vector = require "vec3"

local vec3, istype = vector.type, ffi.istype

-- native.shape(object): light userdata, a shape; nil for any other object. native.shape_distance: the function to ask.
local function make(native)
  local ask = ffi.cast("rapid_shape_distance", native.shape_distance)
  local gradient = ffi.new "double[3]"
  local pointers = setmetatable({}, { __mode = "k" }) -- false: no shape

  local function pointer_of(...)
    local object = ...
    local known = pointers[object]
    if known == nil then
      local pointer = native.shape(object)
      known = pointer ~= nil and ffi.cast("const void*", pointer)
      pointers[object] = known
    end
    return known
  end

  local function refuse(what, shape, P)
    if type(shape) ~= "userdata" or not pointer_of(shape) then
      error(("shape:%s(P) is asked of a shape: with a colon, not a dot"):format(what), 0)
    end
    local shown = (type(P) == "number" or P == nil) and tostring(P) or "a " .. type(P)
    error(("shape:%s(P) takes a vec3, not %s"):format(what, shown), 0)
  end

  local queries = {}

  function queries.distance(...)
    local shape, P = ...
    local pointer = type(shape) == "userdata" and pointer_of(shape)
    if not pointer or not istype(vec3, P) then refuse("distance", shape, P) end
    local distance = ask(pointer, P.x, P.y, P.z, gradient)
    return distance
  end

  function queries.gradient(...)
    local shape, P = ...
    local pointer = type(shape) == "userdata" and pointer_of(shape)
    if not pointer or not istype(vec3, P) then refuse("gradient", shape, P) end
    ask(pointer, P.x, P.y, P.z, gradient)
    return (vec3(gradient[0], gradient[1], gradient[2]))
  end

  return { pointer_of = pointer_of, queries = queries }
end

return { make = make }
