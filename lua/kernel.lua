-- Runners: each runs a kernel over the points of a chunk.
--
-- A kernel sees its point through a view `p` whose reads and writes go to the chunk's columns, at this one point. It
-- never gets a pointer, and cannot express an index outside its own point. The trace compiler inlines all of it. Each
-- kernel gets a runner from generated text, with function prototypes of its own: kernels that share a runner share its
-- traces, and drop to a fifth of their speed.
local describe = require "describe"
local ffi = require "ffi"
local lanes = require "lanes"
local util = require "jit.util"
local vector = require "vec3"

local vec3, quat = vector.type, vector.quat

jit.off(true, true) -- this file, but not the runners' text

-- An attribute's getter and setter by type. $C is its column's pointer, $I the point's index in it, $S its name.
local getter_text = {
  float = "return (tonumber($C[$I]))",
  int32 = "return (tonumber($C[$I]))",
  int64 = "return (tonumber($C[$I]))",
  vec3 = "local a = $C[$I] return (vec3(a.x, a.y, a.z))",
  quat = "local a = $C[$I] return (quat(a.x, a.y, a.z, a.w))",
  string = "return (strings.text($C[$I]))",
}

-- A sum of squares below MAX2 proves in one comparison that all are finite and in range; near MAX2, each is tested.
local setter_text = {
  float = [[
    if type(x) ~= "number" then wrong_type($S, "a number", x) end
    if not (x * x <= MAX2) then not_finite($S, x) end
    $C[i] = x]],
  int32 = [[
    if type(x) ~= "number" then wrong_type($S, "a whole number", x) end
    if not (x >= -2147483648 and x <= 2147483647 and floor(x) == x) then not_whole($S, x) end
    $C[i] = x]],
  int64 = [[
    if type(x) ~= "number" then wrong_type($S, "a whole number", x) end
    if not (x >= -9007199254740992 and x <= 9007199254740992 and floor(x) == x) then not_whole($S, x) end
    $C[i] = x]],
  vec3 = [[
    if not istype(vec3, x) then wrong_type($S, "a vec3", x) end
    local x1, x2, x3 = x.x, x.y, x.z
    if not (x1 * x1 + x2 * x2 + x3 * x3 <= MAX2) and not (x1 * x1 <= MAX2 and x2 * x2 <= MAX2 and x3 * x3 <= MAX2) then
      not_finite($S, x)
    end
    local a = $C[i]
    a.x, a.y, a.z = x1, x2, x3]],
  quat = [[
    if not istype(quat, x) then wrong_type($S, "a quat", x) end
    local x1, x2, x3, x4 = x.x, x.y, x.z, x.w
    if not (x1 * x1 + x2 * x2 + x3 * x3 + x4 * x4 <= MAX2)
        and not (x1 * x1 <= MAX2 and x2 * x2 <= MAX2 and x3 * x3 <= MAX2 and x4 * x4 <= MAX2) then
      not_finite($S, x)
    end
    local a = $C[i]
    a.x, a.y, a.z, a.w = x1, x2, x3, x4]],
  string = [[
    if type(x) ~= "string" then wrong_type($S, "a string", x) end
    $C[i] = strings.number(x)]],
}

-- The form in which Solve stores P and v within a frame.
getter_text.vec3d, setter_text.vec3d = getter_text.vec3, setter_text.vec3

local max_names = 65000 -- approximate; each is one of the 65,536 constants that a function can have

local operators = {
  "__add", "__sub", "__mul", "__div", "__mod", "__pow", "__unm", "__concat", "__len", "__lt", "__le", "__call",
}

-- Suggestions for :attribute, for attributes whose types Houdini fixes.
local conventional = {
  Alpha = "Alpha = 1", Cd = "Cd = {1, 1, 1}", N = "N = {0, 0, 0}", instance = "instance = 0",
  name = "attributes = { name = \"\" }", orient = "orient = {0, 0, 0, 1}", scale = "scale = {1, 1, 1}",
}

local element_type = {
  vec3d = "rapid_double3", float = "float", vec3 = "rapid_float3", quat = "rapid_float4", int32 = "int32_t",
  int64 = "int64_t", string = "uint32_t",
}

-- Makes every operator an error with this message; a comparison with a number would silently be false.
local function refuse_operators(what, meta)
  for _, name in ipairs(operators) do
    meta[name] = function() error(what, 0) end
  end
  meta.__eq = function(a, b)
    if type(a) == "number" or type(b) == "number" then error(what, 0) end
    return rawequal(a, b)
  end
  return meta
end

-- The host adds the position, the nearest line of graph code, and the point.
local function wrong_type(name, expected, value)
  local remedy = ""
  if type(value) == "table" then
    remedy = expected == "a vec3" and "; vec3(x, y, z) makes one"
      or expected == "a quat" and "; quat(x, y, z, w) makes one"
      or ""
  end
  error(("attribute %q takes %s, not %s%s"):format(name, expected, describe.value(value), remedy), 0)
end
local function not_finite(name, value)
  error(("%s became %s; a float must be between -3.4e38 and 3.4e38"):format(name, describe.value(value)), 0)
end
local function not_whole(name, value)
  error(("attribute %q takes a whole number, not %s"):format(name, describe.value(value)), 0)
end

local function sorted_names(map)
  local list = {}
  for name in pairs(map) do list[#list + 1] = name end
  table.sort(list)
  return list
end

-- Raises a view's error for a missing attribute.
local function missing(name, names)
  name = describe.name(name)
  error(("no attribute %q here; declare a computed name with reads = { %q }, or also write it as a constant " ..
    "(the kernel names %s)"):format(name, name, table.concat(sorted_names(names), ", ")), 0)
end

-- Names are compared one after the other: in a trace they are constants, and the comparisons are folded away, while a
-- table lookup would leave its checks. Upvalues that are never assigned, and are no longer than two pointers, are
-- constants there too: the chunk's address, the view, the frame.
local text_head = [[
local ffi, vec3, quat, kernel, memory, frame_type, draw, adopt, shown, refuse, names, flush, strings, holder = ...
local istype, floor, type, tonumber, error = ffi.istype, math.floor, type, tonumber, error
local wrong_type, not_finite, not_whole = refuse.wrong_type, refuse.not_finite, refuse.not_whole
local missing, wrong_use = refuse.missing, refuse.use
local MAX2 = 3.4028234663852886e38 * 3.4028234663852886e38
local columns, chunk, frame = memory, memory.chunk, ffi.cast(ffi.typeof("$&", frame_type), memory)
local point_type, step_type = ffi.typeof "struct {}", ffi.typeof "struct {}"
local p, step = point_type(), step_type()
local params, details = nil, {}

-- Called when the view, its methods or the step are used outside of the loop: columns may be gone by then.
local function dead()
  error("a point can't be used outside its kernel", 0)
end
]]

-- Methods that do more than set a byte of the point; $ID is the point's id.
local text_methods = [[
local function rand(...)
  local _, use, frame_or_number = ...
  local i = chunk.at
  if i < 0 then dead() end
  if type(use) ~= "number" then wrong_use("the index of the random number", use) end
  local frame_number = 0
  if type(frame_or_number) ~= "nil" then -- not by ==, which the frame answers itself
    frame_number = frame_or_number
    if istype(frame_type, frame_number) then
      frame_number = frame_number.number
    elseif istype(step_type, frame_number) then
      frame_number = chunk.times[i]
    end
    if type(frame_number) ~= "number" then wrong_use("the frame or a number as the second argument", frame_number) end
    if frame_number == 0 then frame_number = 5e-324 end -- 0 stands for a number that is the same in every frame
  end
  local drawn = draw(chunk.random, $ID, use, frame_number)
  return drawn
end

local function kill(...)
  local i = chunk.at
  if i < 0 then dead() end
  if chunk.kill == nil then error("kill can't be called here", 0) end
  chunk.kill[i] = 1
end
]]

-- An action gets the step instead of the frame: it has the point's own time.
local text_step = [[
ffi.metatype(step_type, refuse.operators("the step is not a number; use one of its fields, such as step.dt", {
  __metatable = false,
  __tostring = function() return "a step" end,
  __newindex = function(_, name) refuse.step(name) end,
  __index = function(...)
    local _, name = ...
    local i = chunk.at
    if i < 0 then dead() end
    if name == "time" then return (chunk.times[i]) end
    if name == "dt" then return (chunk.steps[i]) end
    if name == "index" then return (chunk.substep) end
    if name == "detail" then return (shown.view) end
    refuse.step(name)
  end,
}))
]]

-- layout.columns: { name, type, uniform, writable }; layout.groups: { name, uniform, writable }; layout.predicate: the
-- kernel's result is stored, and nothing may be written; layout.action: it runs inside Solve. memory: a userdata with
-- room for rapid_chunk followed by a pointer for each column and then each group. The host writes it before each run().
-- Returns run(), set_params(values, details), which sets the third argument of a Lua node's kernel and the values of
-- frame.detail, and translate(), which returns the kernel as a program of lanes if it can be one (lua/lanes.lua).
local function make_runner(kernel, layout, memory, shared)
  local fields, names = { "rapid_chunk chunk;" }, { dt = true }
  for _, name in ipairs(shared.point_names.fields) do names[name] = true end
  local text = { text_head }
  local function add(lines, entry, pointer)
    local values = {
      ["$C"] = "columns." .. pointer, ["$I"] = entry.uniform and "0" or "i", ["$S"] = ("%q"):format(entry.name),
    }
    text[#text + 1] = (lines:gsub("%$%u", values))
  end
  local function add_function(name, arguments, body)
    text[#text + 1] = ("local function %s(...)\nlocal %s = ...\nlocal i = chunk.at\nif i < 0 then dead() end")
      :format(name, arguments)
    body()
    text[#text + 1] = "end"
  end

  for place, column in ipairs(layout.columns) do
    fields[#fields + 1] = ("%s* c%d;"):format(element_type[column.type], place)
    names[column.name] = true
    if column.name == "id" then
      text[#text + 1] = (text_methods:gsub("%$ID", ("columns.c%d[%s]"):format(place, column.uniform and "0" or "i")))
    end
  end
  for place in ipairs(layout.groups) do fields[#fields + 1] = ("uint8_t* g%d;"):format(place) end

  -- Returns the text of a number of the point, or nil if the layout lacks the column.
  local function value_of(name)
    for place, column in ipairs(layout.columns) do
      if column.name == name then return ("columns.c%d[%s]"):format(place, column.uniform and "0" or "i") end
    end
  end

  add_function("within", "_, group", function()
    for place, group in ipairs(layout.groups) do
      add("if group == $S then return ($C[$I] ~= 0) end", group, "g" .. place)
    end
    text[#text + 1] = "return false"
  end)
  local function add_change(what, value)
    add_function(what, "_, group", function()
      for place, group in ipairs(layout.groups) do
        if group.writable then
          add(("if group == $S then $C[i] = %d return end"):format(value), group, "g" .. place)
        end
      end
      text[#text + 1] = ("refuse.group(group, %q)"):format(what)
    end)
  end
  add_change("join", 1)
  add_change("leave", 0)
  add_function("read", "_, name", function()
    for place, column in ipairs(layout.columns) do
      add("if name == $S then " .. getter_text[column.type] .. " end", column, "c" .. place)
    end
    local age, life = value_of "age", value_of "life"
    if not (age and life) then names.nage = nil end
    if age and life then text[#text + 1] = ("if name == \"nage\" then return (%s / %s) end"):format(age, life) end
    text[#text + 1] = [[
if name == "dt" then return (frame.dt) end
if name == "index" then return (chunk.first + i + 1) end]]
    for _, method in ipairs(shared.point_names.methods) do
      text[#text + 1] = ("if name == %q then return %s end"):format(method, method)
    end
    text[#text + 1] = "missing(name, names)"
  end)
  add_function("write", "_, name, x", function()
    for place, column in ipairs(layout.columns) do
      if column.writable then
        add("if name == $S then\n" .. setter_text[column.type] .. "\nreturn end", column, "c" .. place)
      end
    end
    text[#text + 1] = "refuse.write(name)"
  end)
  text[#text + 1] = [[
ffi.metatype(point_type, refuse.operators("p is the point; use one of its attributes, such as p.v", {
  __index = read, __newindex = write, __metatable = false, __tostring = function() return "a point" end,
}))
]]
  if layout.action then text[#text + 1] = text_step end

  local info = util.funcinfo(kernel)
  local body = ("kernel(p, %s%s)"):format(layout.action and "step" or "frame",
    (info.params > 2 or info.isvararg) and ", params" or "")
  if layout.predicate then body = "chunk.result[k] = " .. body .. " and 1 or 0" end
  if layout.masked then body = "if chunk.members[k] ~= 0 then " .. body .. " end" end
  body = "chunk.at = k " .. body
  -- Vararg, so that no trace starts at run() itself. Single points are called without a loop: a loop that always ends
  -- after one point is not compiled, and a trace that single calls have made of the kernel would block a loop's. A
  -- trace follows the branches of the point at which it was recorded; other branches leave it, at half the speed. The
  -- first points are not typical, so the traces are recorded again after a while, most likely at a typical point.
  text[#text + 1] = [[
local run
local calls, renewal, single = 0, 64, false
run = function(...)
  shown.details = details
  if chunk.size == 1 then
    single = true
    local k = 0
    ]] .. body .. [[

  else
    calls = calls + 1
    if single or calls == renewal then
      flush(run)
      flush(kernel, true)
      single, renewal = false, math.max(renewal, calls * 4)
    end
    for k = 0, chunk.size - 1 do ]] .. body .. [[ end
  end
  chunk.at = -1
end
local function set_params(values, detail_values)
  details, holder.values, holder.details = detail_values, values, detail_values
  for _, value in next, values do
    if type(value) == "userdata" then adopt(value) end
  end
  if next(values) == nil then return end -- the kernel of no node: its third argument is nil
  setmetatable(values, { __index = function(_, name) refuse.param(name, values) end })
  params = newproxy(true) -- no table: table.insert would write into it
  local of_params = getmetatable(params)
  of_params.__index, of_params.__metatable = values, false
  of_params.__newindex = function(_, name) refuse.assign(name) end
end
jit.off(set_params) -- once a pass
return run, set_params
]]
  local refuse = { wrong_type = wrong_type, not_whole = not_whole, missing = missing }
  function refuse.not_finite(name, value)
    local chunk = ffi.cast("rapid_chunk*", memory)
    chunk.not_finite = chunk.at
    not_finite(name, value)
  end
  function refuse.write(name)
    if layout.predicate then
      error(("assigns %q; a condition must not change its point"):format(describe.name(name)), 0)
    end
    if shared.point_names.read_only[name] then error(("%s is read-only"):format(name), 0) end
    if names[name] then
      error(("assigns %q by a computed name; declare it with writes = { %q }"):format(name, name), 0)
    end
    name = describe.name(name)
    error(("no attribute %q here; add :attribute{ %s } before it, or declare a computed name with writes = { %q }")
      :format(name, conventional[name] or name .. " = 0", name), 0)
  end
  function refuse.param(name, values)
    error(("no parameter %q; the node has %s"):format(describe.name(name), table.concat(sorted_names(values), ", ")), 0)
  end
  function refuse.assign(name)
    error(("params.%s can't be assigned; parameters are set by the graph"):format(describe.name(name)), 0)
  end
  function refuse.group(name, what)
    error(("can't %s the group %s; write the name as a constant: p:%s \"old\"")
      :format(what, describe.value(name), what), 0)
  end
  refuse.operators = refuse_operators
  function refuse.step(name)
    error(("the step has no %q; it has time, dt, index and detail"):format(describe.name(name)), 0)
  end
  function refuse.use(expected, value)
    error(("p:rand needs %s, not %s"):format(expected, describe.value(value)), 0)
  end
  local make, message = loadstring(table.concat(text, "\n"), "=[rapid runner]")
  if not make then
    if not message:find("constants", 1, true) then error(message, 0) end -- out of memory
    error(("reads and writes %d attributes and groups; a kernel can use at most about %d"):format(
      #layout.columns + #layout.groups, max_names), 0)
  end
  local pointer = ffi.cast(("struct { %s }*"):format(table.concat(fields, " ")), memory)
  local holder = { values = {}, details = {} }
  local run, set_params = make(ffi, vec3, quat, kernel, pointer, shared.frame_type, shared.draw, shared.adopt,
    shared.shown, refuse, names, jit.flush, shared.strings, holder)
  return run, set_params, function() return lanes.translate(kernel, layout, holder) end
end

-- rand: a light userdata, the random function; adopt(object): makes a shape known to traces (lua/shape.lua);
-- point_names: the table of the host; strings: the strings of attributes (lua/text.lua).
local function prepare(rand, adopt, point_names, strings)
  -- Detail values that frame.detail and step.detail show: those of the running pass.
  local shown = { details = {} }
  shown.view = newproxy(true) -- not a table: table.insert would write into it
  local of_view = getmetatable(shown.view)
  of_view.__metatable = false
  of_view.__tostring = function() return "the detail values" end
  of_view.__index = function(...)
    local _, name = ...
    local value = shown.details[name]
    if value == nil then
      local names = sorted_names(shown.details)
      name = describe.name(name)
      error(("no detail value %q; %s"):format(name, #names > 0 and "there are " .. table.concat(names, ", ")
        or "set it in a :detail: points.detail." .. name .. " = 0"), 0)
    end
    return value
  end
  jit.on(of_view.__index)
  of_view.__newindex = function(_, name)
    name = describe.name(name)
    error(("detail.%s can't be assigned in a kernel; assign points.detail.%s in a :detail"):format(name, name), 0)
  end

  local frame_type = ffi.typeof "struct { const double number, time, dt; }"
  local function field_of_frame(...)
    local _, name = ...
    if name == "detail" then return shown.view end
    error(("the frame has no %q; it has number, time, dt and detail"):format(describe.name(name)), 2)
  end
  jit.on(field_of_frame)
  ffi.metatype(frame_type, refuse_operators("the frame is not a number; use one of its fields, such as frame.time", {
    __tostring = function(frame) return ("frame %g"):format(frame.number) end,
    __index = field_of_frame,
  }))
  local shared = {
    frame_type = frame_type, draw = ffi.cast("rapid_rand", rand), adopt = adopt, shown = shown,
    point_names = point_names, strings = strings,
  }
  return {
    frame = function(number, time, dt, details)
      shown.details = details or {}
      return frame_type(number, time, dt)
    end,
    runner = function(kernel, layout, memory) return make_runner(kernel, layout, memory, shared) end,
    rand = shared.draw,
  }
end

return { prepare = prepare }
