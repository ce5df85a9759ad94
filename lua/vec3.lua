-- vec3, quat: immutable values of three and four doubles.
--
-- They are const structs: assigning a component is an error of the language, and compiled traces keep them in
-- registers, so arithmetic on them allocates nothing. The functions are vararg because the trace compiler starts no
-- trace at such a function. They are called so often that it otherwise would, in vain, and then refuse the loops that
-- call them. None ends in a tail call, hence the parentheses: the compiler gives up after fifteen tail calls.
local ffi = require "ffi"
local describe = require "describe"

-- Locals are constants in a trace, while globals are looked up.
local sqrt, sin, acos = math.sqrt, math.sin, math.acos
local istype, type = ffi.istype, type

local vec3 = ffi.typeof "struct { const double x, y, z; }"
local quat = ffi.typeof "struct { const double x, y, z, w; }"

local show = describe.operand

local remedies = {
  ["+"] = "both must be a vec3",
  ["-"] = "both must be a vec3",
  ["*"] = "the other must be a number or a vec3",
  ["/"] = "a vec3 can only be divided by a number or a vec3",
  ["%"] = "use its components",
  ["^"] = "use its components",
}

local function wrong_operand(operator, a, b)
  error(("can't compute %s %s %s; %s"):format(show(a), operator, show(b), remedies[operator]), 3)
end

local function need_vec3(what, value)
  if not istype(vec3, value) then error(("%s needs a vec3, not %s"):format(what, show(value)), 0) end
end

local function need_two(what, a, b)
  need_vec3(what, a)
  need_vec3(what, b)
end

local function dot(...)
  local a, b = ...
  if not (istype(vec3, a) and istype(vec3, b)) then need_two("v:dot(w)", a, b) end
  return a.x * b.x + a.y * b.y + a.z * b.z
end

local function cross(...)
  local a, b = ...
  if not (istype(vec3, a) and istype(vec3, b)) then need_two("v:cross(w)", a, b) end
  return (vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x))
end

local function length(...)
  local a = ...
  if not istype(vec3, a) then need_vec3("v:length()", a) end
  return (sqrt(a.x * a.x + a.y * a.y + a.z * a.z))
end

-- Returns the vector with length 1; the zero vector stays zero.
local function normalized(...)
  local a = ...
  if not istype(vec3, a) then need_vec3("v:normalized()", a) end
  local size = sqrt(a.x * a.x + a.y * a.y + a.z * a.z)
  if size == 0 then return a end
  return (vec3(a.x / size, a.y / size, a.z / size))
end

-- Returns a at t = 0, b at t = 1.
local function lerp(...)
  local a, b, t = ...
  if not (istype(vec3, a) and istype(vec3, b)) then need_two("v:lerp(w, t)", a, b) end
  if type(t) ~= "number" then error(("v:lerp(w, t) needs a number t, not %s"):format(show(t)), 2) end
  return (vec3(a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t, a.z + (b.z - a.z) * t))
end

-- Concatenates numbers, strings and vec3 values.
local function concat(a, b)
  for _, value in ipairs { a, b } do
    local kind = type(value)
    if kind ~= "cdata" and kind ~= "string" and kind ~= "number" then
      error(("attempt to concatenate %s"):format(describe.kind(value)), 2)
    end
  end
  return tostring(a) .. tostring(b)
end

local function no_order()
  error("vec3 values have no order; compare their lengths or components", 2)
end

local of_vec3 = {
  __add = function(...)
    local a, b = ...
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("+", a, b) end
    return (vec3(a.x + b.x, a.y + b.y, a.z + b.z))
  end,
  __sub = function(...)
    local a, b = ...
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("-", a, b) end
    return (vec3(a.x - b.x, a.y - b.y, a.z - b.z))
  end,
  __mul = function(...)
    local a, b = ...
    if type(a) == "number" then return (vec3(a * b.x, a * b.y, a * b.z)) end
    if type(b) == "number" then return (vec3(a.x * b, a.y * b, a.z * b)) end
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("*", a, b) end
    return (vec3(a.x * b.x, a.y * b.y, a.z * b.z))
  end,
  __div = function(...)
    local a, b = ...
    if type(b) == "number" then return (vec3(a.x / b, a.y / b, a.z / b)) end
    if not (istype(vec3, a) and istype(vec3, b)) then wrong_operand("/", a, b) end
    return (vec3(a.x / b.x, a.y / b.y, a.z / b.z))
  end,
  __unm = function(...)
    local a = ...
    return (vec3(-a.x, -a.y, -a.z))
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
  __concat = concat,
  __newindex = function(_, name)
    error(("a vec3 has no %q, and can't be changed; make a new one: vec3(x, y, z)"):format(describe.name(name)), 2)
  end,
  __tostring = function(a)
    return ("vec3(%.9g, %.9g, %.9g)"):format(a.x, a.y, a.z)
  end,
  __index = function(...)
    local _, name = ...
    -- Compared one after the other: traces fold the comparisons away, while a table lookup leaves its checks.
    if name == "cross" then return cross end
    if name == "dot" then return dot end
    if name == "length" then return length end
    if name == "lerp" then return lerp end
    if name == "normalized" then return normalized end
    error(("a vec3 has no %q; it has x, y, z, dot, cross, length, normalized and lerp"):format(describe.name(name)), 2)
  end,
}
ffi.metatype(vec3, of_vec3)

-- Rotations: (x, y, z) = axis sin(angle / 2), w = cos(angle / 2), as Houdini's orient holds them.
local function need_quat(what, value)
  if not istype(quat, value) then error(("%s needs a quat, not %s"):format(what, show(value)), 0) end
end

-- Rotates v: v + 2 w (u x v) + 2 u x (u x v) for the unit quaternion (u, w).
local function rotate(...)
  local q, v = ...
  if not istype(quat, q) then need_quat("q:rotate(v)", q) end
  if not istype(vec3, v) then need_vec3("q:rotate(v)", v) end
  local x, y, z = q.y * v.z - q.z * v.y, q.z * v.x - q.x * v.z, q.x * v.y - q.y * v.x
  local w = q.w
  return (vec3(v.x + 2 * (w * x + q.y * z - q.z * y), v.y + 2 * (w * y + q.z * x - q.x * z),
    v.z + 2 * (w * z + q.x * y - q.y * x)))
end

-- Returns the inverse rotation, for a quaternion of length 1.
local function inverse(...)
  local q = ...
  if not istype(quat, q) then need_quat("q:inverse()", q) end
  return (quat(-q.x, -q.y, -q.z, q.w))
end

local function quat_length(...)
  local q = ...
  if not istype(quat, q) then need_quat("q:length()", q) end
  return (sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w))
end

-- Returns the quaternion with length 1; zero becomes the identity.
local function quat_normalized(...)
  local q = ...
  if not istype(quat, q) then need_quat("q:normalized()", q) end
  local size = sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
  if size == 0 then return (quat(0, 0, 0, 1)) end
  return (quat(q.x / size, q.y / size, q.z / size, q.w / size))
end

-- Returns the shortest rotation from q (t = 0) to r (t = 1), at constant speed; both of length 1.
local function slerp(...)
  local q, r, t = ...
  if not istype(quat, q) then need_quat("q:slerp(r, t)", q) end
  if not istype(quat, r) then need_quat("q:slerp(r, t)", r) end
  if type(t) ~= "number" then error(("q:slerp(r, t) needs a number t, not %s"):format(show(t)), 0) end
  local cosine = q.x * r.x + q.y * r.y + q.z * r.z + q.w * r.w
  local sign = cosine < 0 and -1 or 1 -- r and -r are the same rotation
  cosine = cosine * sign
  local a, b = 1 - t, t * sign
  if cosine < 0.9999995 then -- else the arc is a line, within rounding
    local angle = acos(cosine)
    local s = sin(angle)
    a, b = sin((1 - t) * angle) / s, sin(t * angle) / s * sign
  end
  return (quat(a * q.x + b * r.x, a * q.y + b * r.y, a * q.z + b * r.z, a * q.w + b * r.w))
end

local of_quat = {
  -- Returns the rotation r followed by q.
  __mul = function(...)
    local q, r = ...
    if not (istype(quat, q) and istype(quat, r)) then
      error(("can't compute %s * %s; both must be a quat; to turn a vec3, use q:rotate(v)"):format(show(q),
        show(r)), 2)
    end
    return (quat(q.w * r.x + q.x * r.w + q.y * r.z - q.z * r.y, q.w * r.y - q.x * r.z + q.y * r.w + q.z * r.x,
      q.w * r.z + q.x * r.y - q.y * r.x + q.z * r.w, q.w * r.w - q.x * r.x - q.y * r.y - q.z * r.z))
  end,
  __eq = function(a, b)
    return istype(quat, a) and istype(quat, b) and a.x == b.x and a.y == b.y and a.z == b.z and a.w == b.w
  end,
  __newindex = function(_, name)
    error(("a quat has no %q, and can't be changed; make a new one: quat(x, y, z, w)"):format(describe.name(name)), 2)
  end,
  __tostring = function(a)
    return ("quat(%.9g, %.9g, %.9g, %.9g)"):format(a.x, a.y, a.z, a.w)
  end,
  __concat = concat,
  __index = function(...)
    local _, name = ...
    if name == "inverse" then return inverse end
    if name == "length" then return quat_length end
    if name == "normalized" then return quat_normalized end
    if name == "rotate" then return rotate end
    if name == "slerp" then return slerp end
    error(("a quat has no %q; it has x, y, z, w, rotate, inverse, length, normalized and slerp"):format(
      describe.name(name)), 2)
  end,
}
ffi.metatype(quat, of_quat)

-- Makes a quat from four numbers.
local function make_quat(...)
  local x, y, z, w = ...
  if not (type(x) == "number" and type(y) == "number" and type(z) == "number" and type(w) == "number") then
    error("quat needs four numbers, quat(0, 0, 0, 1); rapid.math.rotation(axis, degrees) makes one from an axis", 2)
  end
  return (quat(x, y, z, w))
end

-- Makes a vec3 from three numbers, or a list of three.
local function make_vec3(...)
  local x, y, z = ...
  if type(x) == "table" then x, y, z = x[1], x[2], x[3] end
  if not (type(x) == "number" and type(y) == "number" and type(z) == "number") then
    local wrong = x
    if type(x) == "number" then wrong = y end
    if type(wrong) == "number" then wrong = z end
    error(("vec3 needs three numbers, vec3(0, 1, 0); one is %s"):format(show(wrong)), 2)
  end
  return (vec3(x, y, z))
end

-- Returns the metatable of one of the types.
local function operators(of)
  return rawequal(of, vec3) and of_vec3 or of_quat
end

return { type = vec3, quat = quat, make = make_vec3, make_quat = make_quat, operators = operators }
