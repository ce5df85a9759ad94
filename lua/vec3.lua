-- vec3, quat: immutable values of three and four doubles.
--
-- They are const structs: assigning a component is an error of the language, and compiled traces keep them in
-- registers, so arithmetic on them allocates nothing. The functions are vararg because the trace compiler starts no
-- trace at such a function: they are called so often that it would, in vain, and then refuse the loops that they are
-- called from.
local ffi = require "ffi"

local sqrt = math.sqrt
local istype = ffi.istype

local vec3 = ffi.typeof "struct { const double x, y, z; }"
local quat = ffi.typeof "struct { const double x, y, z, w; }"

-- As a message shows a value: a vec3 or a number as it is written, any other by its type.
local function show(value)
  local kind = type(value)
  if kind == "cdata" or kind == "number" or kind == "nil" then return tostring(value) end
  return "a " .. kind
end

local remedies = {
  ["+"] = "both must be a vec3",
  ["-"] = "both must be a vec3",
  ["*"] = "the other must be a number or a vec3",
  ["/"] = "a vec3 is divided by a number or a vec3",
  ["%"] = "take its components",
  ["^"] = "take its components",
}

local function wrong_operand(operator, a, b)
  error(("can't compute %s %s %s; %s"):format(show(a), operator, show(b), remedies[operator]), 3)
end

local function need_vec3(what, value)
  if not istype(vec3, value) then error(("%s takes a vec3, not %s"):format(what, show(value)), 0) end
end

local function need_two(what, a, b)
  need_vec3(what, a)
  need_vec3(what, b)
end

local methods = {}

function methods.dot(...)
  local a, b = ...
  if not (istype(vec3, a) and istype(vec3, b)) then need_two("v:dot(w)", a, b) end
  return a.x * b.x + a.y * b.y + a.z * b.z
end

function methods.cross(...)
  local a, b = ...
  if not (istype(vec3, a) and istype(vec3, b)) then need_two("v:cross(w)", a, b) end
  return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
end

function methods.length(...)
  local a = ...
  if not istype(vec3, a) then need_vec3("v:length()", a) end
  return sqrt(a.x * a.x + a.y * a.y + a.z * a.z)
end

-- Of length 1; the zero vector stays zero.
function methods.normalized(...)
  local a = ...
  if not istype(vec3, a) then need_vec3("v:normalized()", a) end
  local length = sqrt(a.x * a.x + a.y * a.y + a.z * a.z)
  if length == 0 then return a end
  return vec3(a.x / length, a.y / length, a.z / length)
end

-- a at t = 0, b at t = 1.
function methods.lerp(...)
  local a, b, t = ...
  if not (istype(vec3, a) and istype(vec3, b)) then need_two("v:lerp(w, t)", a, b) end
  if type(t) ~= "number" then error(("v:lerp(w, t) takes a number t, not %s"):format(show(t)), 2) end
  return vec3(a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t, a.z + (b.z - a.z) * t)
end

local function no_order()
  error("vec3 values have no order; compare their lengths or components", 2)
end

ffi.metatype(vec3, {
  __add = function(...)
    local a, b = ...
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("+", a, b) end
    return vec3(a.x + b.x, a.y + b.y, a.z + b.z)
  end,
  __sub = function(...)
    local a, b = ...
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("-", a, b) end
    return vec3(a.x - b.x, a.y - b.y, a.z - b.z)
  end,
  __mul = function(...)
    local a, b = ...
    if type(a) == "number" then return vec3(a * b.x, a * b.y, a * b.z) end
    if type(b) == "number" then return vec3(a.x * b, a.y * b, a.z * b) end
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("*", a, b) end
    return vec3(a.x * b.x, a.y * b.y, a.z * b.z)
  end,
  __div = function(...)
    local a, b = ...
    if type(b) == "number" then return vec3(a.x / b, a.y / b, a.z / b) end
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("/", a, b) end
    return vec3(a.x / b.x, a.y / b.y, a.z / b.z)
  end,
  __unm = function(...)
    local a = ...
    return vec3(-a.x, -a.y, -a.z)
  end,
  __eq = function(a, b)
    return istype(vec3, a) and istype(vec3, b) and a.x == b.x and a.y == b.y and a.z == b.z
  end,
  __lt = no_order,
  __le = no_order,
  __mod = function(a, b) wrong_operand("%", a, b) end,
  __pow = function(a, b) wrong_operand("^", a, b) end,
  __len = function() error("a vec3 has no #; its length is v:length()", 2) end,
  __call = function() error("a vec3 is not a function", 2) end,
  __concat = function(a, b) return tostring(a) .. tostring(b) end,
  __newindex = function(_, name)
    error(("a vec3 has no %q, and can't be changed; make a new one: vec3(x, y, z)"):format(tostring(name)), 2)
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
    local wrong = x
    if type(x) == "number" then wrong = y end
    if type(wrong) == "number" then wrong = z end
    error(("vec3 takes three numbers, vec3(0, 1, 0); one is %s"):format(show(wrong)), 2)
  end
  return vec3(x, y, z)
end

return { type = vec3, quat = quat, make = make_vec3 }
