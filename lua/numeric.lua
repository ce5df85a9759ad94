-- rapid.math: functions for artists' formulas, in kernels and in a graph's body.
--
--   clamp(x, lo, hi)             x, but at least lo and at most hi
--   fit(x, lo, hi, from, to)     x mapped from [lo, hi] to [from, to], and clamped to its ends
--   smoothstep(lo, hi, x)        0 up to lo, 1 from hi on, smooth between: t² (3 - 2t)
--   noise(P, time, octaves, seed)         a number in [-1, 1] that changes smoothly with position (and time)
--   curl_noise(P, time, octaves, seed)    a vec3, about 1 long: a flow that neither gathers nor spreads points
--   rotation(axis, degrees)      a quat: the rotation about an axis of any nonzero length
--   rotation_between(from, to)   a quat: the shortest rotation of one direction into another
--
-- The noises are those of runtime/math/noise.h: cells of 1 m and 1 s. All but P are optional (0 s, 1 octave, seed 0).
-- The functions are vararg for the reason given in vec3.lua.
local ffi = require "ffi"
local describe = require "describe"
local vector = require "vec3"

local abs, cos, floor, max, min, pi, sin = math.abs, math.cos, math.floor, math.max, math.min, math.pi, math.sin
local vec3, quat, istype, type = vector.type, vector.quat, ffi.istype, type

local show = describe.operand

local function need_numbers(call, ...)
  for place = 1, select("#", ...) do
    local value = select(place, ...)
    if type(value) ~= "number" then error(("%s needs numbers, not %s"):format(call, show(value)), 0) end
  end
end

local numeric = {}

function numeric.clamp(...)
  local x, lo, hi = ...
  if not (type(x) == "number" and type(lo) == "number" and type(hi) == "number") then
    need_numbers("clamp(x, lo, hi)", x, lo, hi)
  end
  if lo > hi then error(("clamp(x, lo, hi): lo = %g is above hi = %g"):format(lo, hi), 0) end
  return (min(hi, max(lo, x))) -- no branch, which could differ from point to point
end

function numeric.fit(...)
  local x, lo, hi, from, to = ...
  if not (type(x) == "number" and type(lo) == "number" and type(hi) == "number" and type(from) == "number"
      and type(to) == "number") then
    need_numbers("fit(x, lo, hi, from, to)", x, lo, hi, from, to)
  end
  if lo == hi then error(("fit(x, lo, hi, from, to): lo and hi are both %g; they must differ"):format(lo), 0) end
  local t = (x - lo) / (hi - lo)
  if t <= 0 then return from end
  if t >= 1 then return to end
  return from + (to - from) * t
end

function numeric.smoothstep(...)
  local lo, hi, x = ...
  if not (type(x) == "number" and type(lo) == "number" and type(hi) == "number") then
    need_numbers("smoothstep(lo, hi, x)", lo, hi, x)
  end
  if lo >= hi then error(("smoothstep(lo, hi, x): lo = %g must be below hi = %g"):format(lo, hi), 0) end
  local t = (x - lo) / (hi - lo)
  if t <= 0 then return 0 end
  if t >= 1 then return 1 end
  return t * t * (3 - 2 * t)
end

local function need_direction(call, value)
  if not istype(vec3, value) then error(("%s needs a vec3, not %s"):format(call, show(value)), 0) end
  error(("%s: %s has no direction; its length must be above 0"):format(call, show(value)), 0)
end

function numeric.rotation(...)
  local axis, degrees = ...
  local length = istype(vec3, axis) and axis:length() or 0
  if length == 0 then need_direction("rotation(axis, degrees)", axis) end
  if type(degrees) ~= "number" then need_numbers("rotation(axis, degrees)", degrees) end
  local half = degrees * (pi / 360)
  local s = sin(half) / length
  return (quat(axis.x * s, axis.y * s, axis.z * s, cos(half)))
end

function numeric.rotation_between(...)
  local from, to = ...
  local lengths = istype(vec3, from) and istype(vec3, to) and from:length() * to:length() or 0
  if lengths == 0 then
    need_direction("rotation_between(from, to)", istype(vec3, from) and from:length() > 0 and to or from)
  end
  -- The length of (from x to, |from||to| + from·to) is twice the cosine of half the angle; it vanishes for opposite
  -- directions.
  local w = lengths + from:dot(to)
  if w <= 1e-12 * lengths then
    local side = abs(from.x) < abs(from.y) and vec3(0, -from.z, from.y) or vec3(-from.z, 0, from.x)
    local length = side:length()
    return (quat(side.x / length, side.y / length, side.z / length, 0))
  end
  local cross = from:cross(to)
  return (quat(cross.x, cross.y, cross.z, w):normalized())
end

local function refuse_noise(name, P, time, octaves, seed)
  local call = name .. "(P, time, octaves, seed)"
  if not istype(vec3, P) then error(("%s needs a vec3 P, not %s"):format(call, show(P)), 0) end
  need_numbers(call, time, octaves, seed)
  if not (octaves >= 1 and octaves <= 16 and floor(octaves) == octaves) then
    error(("%s: octaves = %g; it must be a whole number from 1 to 16"):format(call, octaves), 0)
  end
  error(("%s: seed = %g; it must be a whole number from 0 to 4294967295"):format(call, seed), 0)
end

local function is_legal(...)
  local P, time, octaves, seed = ...
  return istype(vec3, P) and type(time) == "number" and type(octaves) == "number" and type(seed) == "number"
    and octaves >= 1 and octaves <= 16 and floor(octaves) == octaves
    and seed >= 0 and seed <= 4294967295 and floor(seed) == seed
end

-- noise_function, curl_function: light userdata, the host's functions.
local function make(noise_function, curl_function)
  local noise = ffi.cast("rapid_noise", noise_function)
  local curl_noise = ffi.cast("rapid_curl_noise", curl_function)
  local curl = ffi.new "double[3]"

  function numeric.noise(...)
    local P, time, octaves, seed = ...
    time, octaves, seed = time or 0, octaves or 1, seed or 0
    if not is_legal(P, time, octaves, seed) then refuse_noise("noise", P, time, octaves, seed) end
    local value = noise(P.x, P.y, P.z, time, octaves, seed)
    return value
  end

  function numeric.curl_noise(...)
    local P, time, octaves, seed = ...
    time, octaves, seed = time or 0, octaves or 1, seed or 0
    if not is_legal(P, time, octaves, seed) then refuse_noise("curl_noise", P, time, octaves, seed) end
    curl_noise(P.x, P.y, P.z, time, octaves, seed, curl)
    return (vec3(curl[0], curl[1], curl[2]))
  end

  return numeric
end

return { make = make }
