-- The points of a :detail function: the whole set, in one state, in order.
--
--   #points, points[i].P, points[i].heat = 1, points[i]:join "hot", :leave, :within, :kill(), :rand(k)
--   points:add { P = vec3(0, 1, 0), heat = 3 }      appended when the function ends; also `dt`, the time in seconds for
--                                                   which it moves in this frame, and `group`, a name or several
--   points:kill(i)                                  removed when the function ends
--   points:neighbours(i, radius)                    indices of the points within the radius, in order, without i,
--                                                   by the positions at the first search with this radius
--   points:sum "heat", :mean, :min, :max, :bounds() two corners
--   points:sort "heat", points:sort(function(p) return p.P.y end)
--   points.detail.total = 3                         a value that kernels read as frame.detail.total
--   points.events.hits, .deaths, .births            lists of the last step's events, { id =, P =, time =, ... }
--
-- The host provides a column's memory when it is first read, and again when it is first written: until then other sets
-- may share it. Views of points are invalid after the function has ended: each knows the number of its run. The types
-- and functions are made once, as compiled code and FFI types are never freed.
local describe = require "describe"
local ffi = require "ffi"
local vector = require "vec3"

local vec3, quat, istype = vector.type, vector.quat, ffi.istype
local floor, huge = math.floor, math.huge
local MAX = 3.4028234663852886e38

local function wrong_type(name, expected, value)
  error(("attribute %q takes %s, not %s"):format(name, expected, describe.value(value)), 0)
end

local function within_float(x)
  return x >= -MAX and x <= MAX
end

local function check_whole(least, most)
  return function(name, x)
    if type(x) ~= "number" then wrong_type(name, "a whole number", x) end
    if not (x >= least and x <= most and floor(x) == x) then
      error(("attribute %q takes a whole number, not %s"):format(name, describe.value(x)), 0)
    end
  end
end

local function not_finite(name, x)
  error(("%s became %s; a float must be between -3.4e38 and 3.4e38"):format(name, describe.value(x)), 0)
end

local function load_number(data, k) return tonumber(data[k]) end
local function store_number(data, k, x) data[k] = x end

-- Types of columns: the pointer, the check of a value, and how to read and write it at k scalars from the first.
local types = {
  float = {
    pointer = "float*", scalars = 1, load = load_number, store = store_number,
    check = function(name, x)
      if type(x) ~= "number" then wrong_type(name, "a number", x) end
      if not within_float(x) then not_finite(name, x) end
    end,
  },
  int32 = {
    pointer = "int32_t*", scalars = 1, load = load_number, store = store_number,
    check = check_whole(-2147483648, 2147483647),
  },
  int64 = {
    pointer = "int64_t*", scalars = 1, load = load_number, store = store_number,
    check = check_whole(-9007199254740992, 9007199254740992),
  },
  vec3 = {
    pointer = "float*", scalars = 3,
    load = function(data, k) return vec3(data[k], data[k + 1], data[k + 2]) end,
    store = function(data, k, x) data[k], data[k + 1], data[k + 2] = x.x, x.y, x.z end,
    check = function(name, x)
      if not istype(vec3, x) then wrong_type(name, "a vec3", x) end
      if not (within_float(x.x) and within_float(x.y) and within_float(x.z)) then not_finite(name, x) end
    end,
  },
  quat = {
    pointer = "float*", scalars = 4,
    load = function(data, k) return quat(data[k], data[k + 1], data[k + 2], data[k + 3]) end,
    store = function(data, k, x) data[k], data[k + 1], data[k + 2], data[k + 3] = x.x, x.y, x.z, x.w end,
    check = function(name, x)
      if not istype(quat, x) then wrong_type(name, "a quat", x) end
      if not (within_float(x.x) and within_float(x.y) and within_float(x.z) and within_float(x.w)) then
        not_finite(name, x)
      end
    end,
  },
}

-- strings: the strings of attributes (lua/text.lua).
local function string_type(strings)
  return {
    pointer = "uint32_t*", scalars = 1,
    load = function(data, k) return strings.text(data[k]) end,
    store = function(data, k, x) data[k] = strings.number(x) end,
    check = function(name, x)
      if type(x) ~= "string" then wrong_type(name, "a string", x) end
    end,
  }
end

local over = "points can't be used outside the :detail function that received them"

-- native: the host's functions, which act on the set that the function runs on; rand: the random function of kernels;
-- point_names: the host's table of a point's names; strings: the strings of attributes (lua/text.lua). Returns run(f,
-- frame, params, size, random, details), which returns the indices (from 0) of the killed points, and the details.
local function make(native, rand, point_names, strings)
  local string_attribute = string_type(strings)
  local read_only = point_names.read_only
  -- State of the current run. Only one runs at a time.
  local columns, groups, killed, added, size, frame, random, details
  local happened -- the contents of points.events, once requested
  local serial = ffi.cast("const int32_t*", native.serial) -- number of the run; changes as soon as it has ended

  -- Fields hide attributes of the same name from __index, so they have unlikely names.
  local point_view = ffi.typeof "struct { const int32_t rapid_place, rapid_serial; }"
  local set_view = ffi.typeof "struct { const int32_t rapid_serial; }"

  local function column_of(name, writable)
    local column = columns[name]
    if column and (column.writable or not writable) then return column end
    if type(name) ~= "string" then
      error(("the name of an attribute must be a string, not %s"):format(describe.value(name)), 0)
    end
    local data, stride, kind = native.column(name, writable) -- raises an error that lists the attributes
    local about = kind == "string" and string_attribute or types[kind]
    column = {
      data = ffi.cast(about.pointer, data), stride = stride, writable = writable,
      load = about.load, store = about.store, check = about.check, kind = kind,
    }
    columns[name] = column
    return column
  end
  local function group_of(name, writable)
    if type(name) ~= "string" then
      error(("the name of a group must be a string, not %s"):format(describe.value(name)), 0)
    end
    local group = groups[name]
    if group and (group.writable or not writable) then return group end
    local data, stride = native.group(name, writable)
    if not data then return nil end -- the group has no members yet
    group = { data = ffi.cast("uint8_t*", data), stride = stride, writable = writable }
    groups[name] = group
    return group
  end

  local function load(name, i)
    if name == "dt" and not native.has "dt" then return frame.dt end -- no point is newborn
    local column = column_of(name, false)
    return column.load(column.data, i * column.stride)
  end

  -- Checked before any memory is touched, since scripts can call methods with any value.
  local function place_in(p, method)
    if not istype(point_view, p) then
      error(("p:%s must be called with a colon, not a dot"):format(method), 0)
    end
    if p.rapid_serial ~= serial[0] then error(over, 0) end
    return p.rapid_place
  end

  local methods = {}
  function methods.within(p, name)
    local place, group = place_in(p, "within"), group_of(name, false)
    return group ~= nil and group.data[place * group.stride] ~= 0
  end
  function methods.join(p, name)
    local place = place_in(p, "join")
    group_of(name, true).data[place] = 1
  end
  function methods.leave(p, name)
    local place = place_in(p, "leave")
    group_of(name, true).data[place] = 0
  end
  function methods.kill(p)
    killed[place_in(p, "kill")] = true
  end
  function methods.rand(p, use, when)
    local place = place_in(p, "rand")
    if rawequal(when, frame) then when = frame.number end
    if type(use) ~= "number" or (when ~= nil and type(when) ~= "number") then
      error("p:rand needs the index of the random number, and the frame for new numbers in each frame", 0)
    end
    return rand(random, load("id", place), use, when == 0 and 5e-324 or when or 0)
  end
  for _, name in ipairs(point_names.methods) do assert(methods[name], name) end

  ffi.metatype(point_view, {
    __index = function(p, name)
      if p.rapid_serial ~= serial[0] then error(over, 0) end
      if name == "index" then return p.rapid_place + 1 end
      if name == "nage" then return p.age / p.life end
      return methods[name] or load(name, p.rapid_place)
    end,
    __newindex = function(p, name, x)
      if p.rapid_serial ~= serial[0] then error(over, 0) end
      if read_only[name] then error(("%s is read-only"):format(name), 0) end
      local column = column_of(name, true)
      column.check(name, x)
      column.store(column.data, p.rapid_place * column.stride, x)
    end,
    __tostring = function(p) return ("point %d"):format(p.rapid_place + 1) end,
  })

  local function check_set(points, method)
    if not istype(set_view, points) then
      error(("points:%s must be called with a colon, not a dot"):format(method), 0)
    end
    if points.rapid_serial ~= serial[0] then error(over, 0) end
  end

  local function place_of(what, i)
    if type(i) ~= "number" or floor(i) ~= i or i < 1 or i > size then
      error(("%s: there is no point %s; the set has 1 to %d"):format(what, describe.value(i), size), 0)
    end
    return i - 1
  end

  -- Folds a column's values in order.
  local function fold(name, empty, start, step)
    local column = column_of(name, false)
    if column.kind == "quat" or column.kind == "string" then
      error(("attribute %q is a %s, which can't be sorted or summed"):format(name, column.kind), 0)
    end
    if size == 0 then return empty end
    if column.kind ~= "vec3" then
      local total = start
      for i = 0, size - 1 do total = step(total, column.load(column.data, i * column.stride)) end
      return total
    end
    local x, y, z = start, start, start
    for i = 0, size - 1 do
      local value = column.load(column.data, i * column.stride)
      x, y, z = step(x, value.x), step(y, value.y), step(z, value.z)
    end
    return vec3(x, y, z)
  end
  local function plus(a, b) return a + b end
  local function smaller(a, b) return b < a and b or a end
  local function larger(a, b) return b > a and b or a end

  local set = {} -- the methods of `points`
  function set.sum(points, name)
    check_set(points, "sum")
    return fold(name, 0, 0, plus)
  end
  function set.mean(points, name)
    check_set(points, "mean")
    local total = fold(name, 0, 0, plus)
    return size > 0 and total / size or nil
  end
  function set.min(points, name)
    check_set(points, "min")
    return fold(name, nil, huge, smaller)
  end
  function set.max(points, name)
    check_set(points, "max")
    return fold(name, nil, -huge, larger)
  end
  function set.bounds(points)
    return set.min(points, "P"), set.max(points, "P")
  end
  function set.kill(points, i)
    check_set(points, "kill")
    killed[place_of("points:kill", i)] = true
  end
  -- Accepts a list of numbers as a vector.
  local function vector_of(column, value)
    if type(value) ~= "table" then return value end
    local n = column.kind == "vec3" and 3 or column.kind == "quat" and 4
    for k = 1, n or 0 do
      if #value ~= n or type(value[k]) ~= "number" then return value end
    end
    return n == 3 and vec3(value[1], value[2], value[3]) or n == 4 and quat(value[1], value[2], value[3], value[4])
      or value
  end
  local function check_time(dt)
    if type(dt) ~= "number" or not (dt >= 0 and dt <= frame.dt) then
      error(("points:add: dt = %s; it must be from 0 to %.9g s, the time that the point moves in this frame"):format(
        describe.value(dt), frame.dt), 0)
    end
    return dt
  end
  local function list_of_groups(names)
    local list = type(names) == "table" and names or { names }
    for _, name in ipairs(list) do
      if type(name) ~= "string" or not group_of(name, false) then
        error(("points:add: no node makes a group %s"):format(describe.value(name)), 0)
      end
    end
    return list
  end

  function set.add(points, values)
    check_set(points, "add")
    if type(values) ~= "table" then error("points:add needs the values of the new point: { P = vec3(x, y, z) }", 0) end
    local copy, names = {}, {}
    for name in pairs(values) do
      if type(name) ~= "string" then
        error(("points:add needs values by name, { P = vec3(x, y, z) }, not by %s"):format(describe.value(name)), 0)
      end
      names[#names + 1] = name
    end
    table.sort(names) -- so that the first wrong one is always the same
    for _, name in ipairs(names) do
      if name == "dt" then
        copy.dt = check_time(values.dt)
      elseif name == "group" then
        copy.group = list_of_groups(values.group)
      else
        if read_only[name] then error(("%s is read-only"):format(name), 0) end
        local column = column_of(name, false)
        copy[name] = vector_of(column, values[name])
        column.check(name, copy[name])
      end
    end
    added[#added + 1] = copy
  end
  function set.neighbours(points, i, radius)
    check_set(points, "neighbours")
    if type(radius) ~= "number" then
      error(("points:neighbours: the radius is %s; give an index and a number: points:neighbours(i, radius)")
        :format(describe.value(radius)), 0)
    end
    return native.neighbours(place_of("points:neighbours", i), radius)
  end
  function set.sort(points, key)
    check_set(points, "sort")
    local of = key
    if type(key) == "string" then
      of = function(p) return p[key] end
    elseif type(key) ~= "function" then
      error(("points:sort needs the name of an attribute or a function of a point, not %s")
        :format(describe.value(key)), 0)
    end
    local keys, order = {}, {}
    for i = 1, size do
      keys[i], order[i] = of(point_view(i - 1, serial[0])), i
      if type(keys[i]) ~= "number" or keys[i] ~= keys[i] then
        error(("points:sort: the key of point %d is %s; it must be a number"):format(i, describe.value(keys[i])), 0)
      end
    end
    check_set(points, "sort") -- a key function that yields may be resumed after the run has ended
    table.sort(order, function(a, b)
      if keys[a] ~= keys[b] then return keys[a] < keys[b] end
      return a < b
    end)
    native.reorder(order)
    local before = killed
    columns, groups, killed = {}, {}, {}
    for i = 1, size do killed[i - 1] = before[order[i] - 1] end
  end

  -- The view behind points.detail.
  local values_view = newproxy(true)
  local of_values = getmetatable(values_view)
  of_values.__metatable = false
  of_values.__tostring = function() return "the detail values" end
  of_values.__index = function(_, name) return details[name] end
  of_values.__newindex = function(_, name, value)
    local finite = type(value) == "number" and value > -huge and value < huge or istype(vec3, value)
    if type(name) ~= "string" or not finite then
      error(("points.detail.%s = %s; a detail value is a finite number or a vec3"):format(describe.name(name),
        describe.value(value)), 0)
    end
    details[name] = value
  end

  -- Returns "add, bounds, detail, ... and sum".
  local function names_of_set()
    local names = { "detail", "events" }
    for name in pairs(set) do names[#names + 1] = name end
    table.sort(names)
    local last = table.remove(names)
    return table.concat(names, ", ") .. " and " .. last
  end

  ffi.metatype(set_view, {
    __len = function() return size end,
    __tostring = function() return ("%d points"):format(size) end,
    __index = function(points, key)
      if points.rapid_serial ~= serial[0] then error(over, 0) end
      if type(key) == "number" then return point_view(place_of("points", key), serial[0]) end
      if key == "detail" then return values_view end
      if key == "events" then
        happened = happened or native.events()
        return happened
      end
      local known = set[key]
      if known == nil then
        error(("points have no %s; they have %s"):format(describe.value(key), names_of_set()), 0)
      end
      return known
    end,
    __newindex = function(_, key)
      error(("points[%s] can't be assigned; assign the attributes of a point"):format(describe.value(key)), 0)
    end,
  })

  local function append_added()
    if #added == 0 then return end
    local timed = false
    for _, values in ipairs(added) do timed = timed or values.dt ~= nil end
    native.append(#added, timed and frame.dt or nil)
    columns, groups = {}, {}
    if native.has "dt" and (timed or column_of("dt", false).stride ~= 0) then
      local column = column_of("dt", true)
      for k, values in ipairs(added) do column.store(column.data, size + k - 1, values.dt or frame.dt) end
    end
    for k, values in ipairs(added) do
      for _, name in ipairs(values.group or {}) do group_of(name, true).data[size + k - 1] = 1 end
      values.dt, values.group = nil, nil
      for name, value in pairs(values) do
        local column = column_of(name, true)
        column.store(column.data, (size + k - 1) * column.stride, value)
      end
    end
  end

  return function(f, now, params, count, key, detail_values)
    columns, groups, killed, added = {}, {}, {}, {}
    size, frame, random, details, happened = count, now, key, detail_values, nil
    f(set_view(serial[0]), now, params)
    append_added()
    local indices = {}
    for i = 0, size - 1 do
      if killed[i] then indices[#indices + 1] = i end
    end
    return indices, details
  end
end

return { make = make }
