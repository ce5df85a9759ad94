-- vec3, quat: immutable values of three and four doubles.
--
-- They are const structs: assigning a component is an error of the language, and compiled traces keep them in registers,
-- so arithmetic on them allocates nothing. The functions are vararg because the trace compiler starts no trace at such a
-- function: they are called so often that it would, in vain, and then refuse the loops that they are called from.
local ffi = require "ffi"

local sqrt = math.sqrt
local istype = ffi.istype

local vec3 = ffi.typeof "struct { const double x, y, z; }"
local quat = ffi.typeof "struct { const double x, y, z, w; }"

local function wrong_operand(what, value)
  error(("can't %s a vec3 and %s"):format(what, type(value) == "cdata" and tostring(value) or "a " .. type(value)), 3)
end

local methods = {}

function methods.dot(...)
  local a, b = ...
  return a.x * b.x + a.y * b.y + a.z * b.z
end

function methods.cross(...)
  local a, b = ...
  return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
end

function methods.length(...)
  local a = ...
  return sqrt(a.x * a.x + a.y * a.y + a.z * a.z)
end

-- Of length 1; the zero vector stays zero.
function methods.normalized(...)
  local a = ...
  local length = sqrt(a.x * a.x + a.y * a.y + a.z * a.z)
  if length == 0 then return a end
  return vec3(a.x / length, a.y / length, a.z / length)
end

-- a at t = 0, b at t = 1.
function methods.lerp(...)
  local a, b, t = ...
  return vec3(a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t, a.z + (b.z - a.z) * t)
end

ffi.metatype(vec3, {
  __add = function(...)
    local a, b = ...
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("add", istype(vec3, a) and b or a) end
    return vec3(a.x + b.x, a.y + b.y, a.z + b.z)
  end,
  __sub = function(...)
    local a, b = ...
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("subtract", istype(vec3, a) and b or a) end
    return vec3(a.x - b.x, a.y - b.y, a.z - b.z)
  end,
  __mul = function(...)
    local a, b = ...
    if type(a) == "number" then return vec3(a * b.x, a * b.y, a * b.z) end
    if type(b) == "number" then return vec3(a.x * b, a.y * b, a.z * b) end
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("multiply", istype(vec3, a) and b or a) end
    return vec3(a.x * b.x, a.y * b.y, a.z * b.z)
  end,
  __div = function(...)
    local a, b = ...
    if type(b) == "number" then return vec3(a.x / b, a.y / b, a.z / b) end
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("divide", istype(vec3, a) and b or a) end
    return vec3(a.x / b.x, a.y / b.y, a.z / b.z)
  end,
  __unm = function(...)
    local a = ...
    return vec3(-a.x, -a.y, -a.z)
  end,
  __eq = function(a, b)
    return istype(vec3, a) and istype(vec3, b) and a.x == b.x and a.y == b.y and a.z == b.z
  end,
  __tostring = function(a)
    return ("vec3(%.9g, %.9g, %.9g)"):format(a.x, a.y, a.z)
  end,
  __index = function(...)
    local _, name = ...
    local method = methods[name]
    if method then return method end
    error(("a vec3 has no %q; it has x, y, z, dot, cross, length, normalized and lerp"):format(tostring(name)), 2)
  end,
})

ffi.metatype(quat, {
  __eq = function(a, b)
    return istype(quat, a) and istype(quat, b) and a.x == b.x and a.y == b.y and a.z == b.z and a.w == b.w
  end,
  __tostring = function(a)
    return ("quat(%.9g, %.9g, %.9g, %.9g)"):format(a.x, a.y, a.z, a.w)
  end,
})

-- From three numbers, or a list of three.
local function make_vec3(...)
  local x, y, z = ...
  if type(x) == "table" then x, y, z = x[1], x[2], x[3] end
  if not (type(x) == "number" and type(y) == "number" and type(z) == "number") then
    error("vec3 takes three numbers: vec3(0, 1, 0)", 2)
  end
  return vec3(x, y, z)
end

return { type = vec3, quat = quat, make = make_vec3 }
