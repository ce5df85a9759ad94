-- Assertions about points, besides busted's own:
--
--   assert.near(expected, actual, tolerance)          numbers and vec3 (length of the difference); NaN is never near
--   assert.points(p).finite()                         no NaN, no infinity
--   assert.points(p).outside(distance, tolerance)     distance(P) >= -tolerance for every point
--   assert.points(p).inside(distance, tolerance)      distance(P) <= tolerance
--   assert.conserved(result, quantity, tolerance)     the sum of quantity(point), numbers or vec3, equals that of the
--                                                     first frame at every frame
--   assert.same_points(a, b)                          the same points, attributes and groups, bitwise
local assert = require "luassert"
local say = require "say"
local vector = require "vec3"
local ffi = require "ffi"

-- Registers an assertion whose callback returns the fault as a string, or nil.
local function register(name, find_fault)
  local key = "assertion." .. name
  say:set(key .. ".positive", "%s")
  say:set(key .. ".negative", "%s")
  assert:register("assertion", name, function(state, arguments)
    local fault = find_fault(state, arguments)
    arguments[1] = fault or ("did not expect: " .. name)
    arguments.n = 1
    arguments.nofmt = { true }
    return fault == nil
  end, key .. ".positive", key .. ".negative")
end

local function show(value)
  return type(value) == "number" and ("%.9g"):format(value) or tostring(value)
end

local function distance_between(a, b)
  if type(a) == "table" then a = vector.make(a) end
  if type(b) == "table" then b = vector.make(b) end
  if type(a) == "number" and type(b) == "number" then return math.abs(a - b) end
  if ffi.istype(vector.type, a) and ffi.istype(vector.type, b) then return (a - b):length() end
end

return function(native)
  register("near", function(_, arguments)
    local expected, actual, tolerance = arguments[1], arguments[2], arguments[3]
    if type(tolerance) ~= "number" then
      return "assert.near needs an expected value, an actual value and a tolerance"
    end
    -- Equal infinities have no difference.
    if expected == actual then return nil end
    local distance = distance_between(expected, actual)
    if not distance then return ("%s and %s can't be compared"):format(show(expected), show(actual)) end
    if distance <= tolerance then return nil end
    return ("%s is not within %s of %s; the difference is %s"):format(show(actual), show(tolerance), show(expected),
      show(distance))
  end)

  assert:register("modifier", "points", function(state, arguments)
    -- Called again without arguments by the assertion itself.
    if arguments then rawset(state, "points", arguments[1]) end
  end)

  local function points_of(state)
    local points = rawget(state, "points")
    if type(points) ~= "userdata" then
      error("assert.points needs the points of a frame: assert.points(result[48]).finite()", 0)
    end
    return points
  end

  register("finite", function(state)
    return native.not_finite(points_of(state))
  end)

  -- Returns the point furthest on the wrong side; sign is 1 if outside is right.
  local function wrong_side(points, distance, tolerance, sign, side)
    local worst, fault = tolerance or 0, nil
    for i = 1, #points do
      local P = points[i].P
      local depth = -sign * distance(P)
      if depth > worst or depth ~= depth then
        worst = depth
        fault = ("%s, point %d (id %d): %s is %.3g m %s"):format(native.source(points), i, points[i].id, show(P), depth,
          side)
      end
    end
    return fault
  end
  register("outside", function(state, arguments)
    return wrong_side(points_of(state), arguments[1], arguments[2], 1, "inside")
  end)
  register("inside", function(state, arguments)
    return wrong_side(points_of(state), arguments[1], arguments[2], -1, "outside")
  end)

  -- Returns the sum of a quantity, and each point's own by id.
  local function sum_of(points, quantity)
    local sum, by_id = nil, {}
    for i = 1, #points do
      local value = quantity(points[i])
      by_id[points[i].id] = value
      sum = sum and sum + value or value
    end
    return sum or 0, by_id
  end

  -- Returns the point whose quantity differs most between two frames.
  local function most_changed(before, after, points)
    local most, what = -1, "there are no points"
    for i = 1, #points do
      local id = points[i].id
      local change = before[id] and distance_between(before[id], after[id]) or math.huge
      if change > most or change ~= change then
        most = change
        what = ("point %d (id %d): %s, and %s before"):format(i, id, show(after[id]), before[id] and show(before[id])
          or "not there")
      end
    end
    return what
  end

  register("conserved", function(_, arguments)
    local result, quantity, tolerance = arguments[1], arguments[2], arguments[3]
    if type(quantity) ~= "function" or type(tolerance) ~= "number" then
      return "assert.conserved needs the result of rapid.run, a function of a point and a tolerance"
    end
    local first, of_points
    for frame, points in result:frames() do
      local sum, by_id = sum_of(points, quantity)
      if not first then
        first, of_points = sum, by_id
      else
        local off = distance_between(first, sum)
        if not off then return ("%s and %s can't be compared"):format(show(first), show(sum)) end
        if off > tolerance or off ~= off then
          return ("frame %d: the sum is %s, and %s in the first frame; the difference is %s; the largest change " ..
            "has %s"):format(frame,
            show(sum), show(first), show(off), most_changed(of_points, by_id, points))
        end
      end
    end
  end)

  register("same_points", function(_, arguments)
    return native.difference(arguments[1], arguments[2])
  end)
end
