-- Runners: what carries a kernel over the points of a chunk.
--
-- A kernel sees the point through a view `p` whose reads and writes are closures over the chunk's columns; it never
-- gets a pointer, and an index outside its own point cannot be said. The trace compiler inlines all of it. Each kernel
-- gets a runner from generated text, with function prototypes of its own: kernels that share one runner share its
-- traces, and fall to a fifth of their speed.
local ffi = require "ffi"
local vector = require "vec3"
local words = require "words"

local vec3, quat = vector.type, vector.quat

jit.off(true, true) -- all of this file, but not the runners' text

-- One attribute's getter and setter by type. $N is its column's number, $S its name.
local getter_text = {
  float = "return (tonumber(c$N[cursor.i * s$N]))",
  int32 = "return (tonumber(c$N[cursor.i * s$N]))",
  int64 = "return (tonumber(c$N[cursor.i * s$N]))",
  vec3 = "local k = cursor.i * s$N return (vec3(c$N[k], c$N[k + 1], c$N[k + 2]))",
  quat = "local k = cursor.i * s$N return (quat(c$N[k], c$N[k + 1], c$N[k + 2], c$N[k + 3]))",
}

local setter_text = {
  float = [[
    if type(x) ~= "number" then wrong_type($S, "a number", x) end
    if not (x >= -MAX and x <= MAX) then not_finite($S, x) end
    c$N[cursor.i] = x]],
  int32 = [[
    if type(x) ~= "number" then wrong_type($S, "a whole number", x) end
    if not (x >= -2147483648 and x <= 2147483647 and floor(x) == x) then not_whole($S, x) end
    c$N[cursor.i] = x]],
  int64 = [[
    if type(x) ~= "number" then wrong_type($S, "a whole number", x) end
    if not (x >= -9007199254740992 and x <= 9007199254740992 and floor(x) == x) then not_whole($S, x) end
    c$N[cursor.i] = x]],
  vec3 = [[
    if not istype(vec3, x) then wrong_type($S, "a vec3", x) end
    local x1, x2, x3 = x.x, x.y, x.z
    if not (x1 >= -MAX and x1 <= MAX and x2 >= -MAX and x2 <= MAX and x3 >= -MAX and x3 <= MAX) then
      not_finite($S, x)
    end
    local k = cursor.i * 3
    c$N[k], c$N[k + 1], c$N[k + 2] = x1, x2, x3]],
  quat = [[
    if not istype(quat, x) then wrong_type($S, "a quat", x) end
    local x1, x2, x3, x4 = x.x, x.y, x.z, x.w
    if not (x1 >= -MAX and x1 <= MAX and x2 >= -MAX and x2 <= MAX and x3 >= -MAX and x3 <= MAX and x4 >= -MAX
        and x4 <= MAX) then
      not_finite($S, x)
    end
    local k = cursor.i * 4
    c$N[k], c$N[k + 1], c$N[k + 2], c$N[k + 3] = x1, x2, x3, x4]],
}

-- As Solve holds P and v within a frame.
getter_text.vec3d, setter_text.vec3d = getter_text.vec3, setter_text.vec3

-- The names of pointers in the runners' text: types that have been read once, not at every chunk.
local pointer_type = {
  vec3d = "doubles", float = "floats", vec3 = "floats", quat = "floats", int32 = "int32s", int64 = "int64s",
}

local describe = words.value

-- The host adds the place, the nearest line of graph code, and the point.
local function wrong_type(name, wanted, value)
  local remedy = ""
  if type(value) == "table" then
    remedy = wanted == "a vec3" and "; vec3(x, y, z) makes one" or wanted == "a quat" and "; quat(x, y, z, w) makes one"
      or ""
  end
  error(("attribute %q takes %s, not %s%s"):format(name, wanted, describe(value), remedy), 0)
end
local function not_finite(name, value)
  error(("%s became %s; a float is finite, within 3.4e38 either way"):format(name, describe(value)), 0)
end
local function not_whole(name, value)
  error(("attribute %q takes a whole number, not %s"):format(name, describe(value)), 0)
end

local function sorted_names(map)
  local list = {}
  for name in pairs(map) do list[#list + 1] = name end
  table.sort(list)
  return list
end

-- A view's refusals.
local function missing(name, getters)
  error(("no attribute %q here; a computed name must be one that the kernel also names as a constant (it names %s)")
    :format(words.name(name), table.concat(sorted_names(getters), ", ")), 0)
end

local text_head = [[
local ffi, vec3, quat, kernel, frame_type, rand, adopt, shown, refuse, layout = ...
local istype, cast, floor, type, tonumber, error = ffi.istype, ffi.cast, math.floor, type, tonumber, error
local wrong_type, not_finite, not_whole = refuse.wrong_type, refuse.not_finite, refuse.not_whole
local missing, wrong_use = refuse.missing, refuse.use
local MAX = 3.4028234663852886e38
local chunks, floats, doubles = ffi.typeof "rapid_chunk*", ffi.typeof "float*", ffi.typeof "double*"
local int32s, int64s, bytes = ffi.typeof "int32_t*", ffi.typeof "int64_t*", ffi.typeof "uint8_t*"
local cursor = ffi.new "struct { int32_t i; }" -- the point; no upvalue, so that setting it spoils no other load
cursor.i = -1
local first, frame, random, params, details = 0, nil, 0, nil, {}
local kill, result, members, substep, times, steps, step
local getters, setters, methods = {}, {}, {}
local id_column, id_stride
local setup = function(...) end -- of the columns and groups

-- What the view, its methods and the step do outside of the loop: columns may be gone by then.
local function dead()
  error("a point can't be used outside its kernel", 0)
end
]]

local text_methods = [[
function methods.rand(...)
  local _, use, frame_or_number = ...
  if cursor.i < 0 then dead() end
  if type(use) ~= "number" then wrong_use("a number, which of the point's random numbers", use) end
  local anew = 0
  if frame_or_number ~= nil then
    anew = frame_or_number
    if istype(frame_type, anew) then anew = anew.number elseif anew == step then anew = times[cursor.i] end
    if type(anew) ~= "number" then wrong_use("the frame, or a number, behind the comma", anew) end
    if anew == 0 then anew = 5e-324 end -- 0 is the number that stays the same in every frame
  end
  local drawn = rand(random, id_column[cursor.i * id_stride], use, anew)
  return drawn
end

function methods.kill(...)
  if cursor.i < 0 then dead() end
  if kill == nil then error("kill is out of reach here", 0) end
  kill[cursor.i] = 1
end

local function read(...)
  local _, name = ...
  if cursor.i < 0 then dead() end
  local get = getters[name]
  if get then
    local value = get() -- no tail call: the trace compiler gives up after fifteen of them
    return value
  end
  local method = methods[name]
  if method then return method end
  missing(name, getters)
end

local function write(...)
  local _, name, x = ...
  if cursor.i < 0 then dead() end
  local set = setters[name]
  if set then
    set(x)
    return
  end
  refuse.write(name, getters)
end

local p = newproxy(true)
local view = getmetatable(p)
view.__index, view.__newindex, view.__metatable = read, write, false
view.__tostring = function() return "a point" end
]]

-- What an action gets in place of the frame: the point's own time.
local text_step = [[
local step_getters = {
  time = function(...) return times[cursor.i] end,
  dt = function(...) return steps[cursor.i] end,
  index = function(...) return substep end,
  detail = function(...) return shown.view end,
}
step = newproxy(true)
local step_view = getmetatable(step)
step_view.__metatable = false
step_view.__tostring = function() return "a step" end
step_view.__index = function(...)
  local _, name = ...
  if cursor.i < 0 then dead() end
  local get = step_getters[name]
  if not get then refuse.step(name) end
  local value = get()
  return value
end
]]

local block_size = 8

-- layout.columns: { name, type, slot (from 0), writable }; layout.groups: { name, slot, writable };
-- layout.predicate: the kernel's result is kept, and nothing may be written; layout.action: it runs inside Solve.
-- Returns run(chunk); at(), the place in the set of the point that is being worked on; and set_params(values), for the
-- third argument of a Lua node's kernel.
local function make_runner(kernel, layout, pointers)
  local text = { text_head }
  local function add(line, name, slot)
    -- A function gives the name, in which % means nothing.
    text[#text + 1] = (line:gsub("%$N", slot or ""):gsub("%$S", function() return ("%q"):format(name) end))
  end

  -- A block of columns or groups with its locals; begin() calls the last block's setup, and that the one before. A
  -- function of Lua has at most 200 locals and 60 upvalues.
  local function add_blocks(entries, add_entry)
    for from = 1, #entries, block_size do
      text[#text + 1] = "do\nlocal before = setup"
      local lines = {}
      for place = from, math.min(from + block_size - 1, #entries) do
        lines[#lines + 1] = add_entry(entries[place], tostring(entries[place].slot))
      end
      text[#text + 1] = "setup = function(...)\nlocal chunk = ...\nbefore(chunk)\n" .. table.concat(lines, "\n")
        .. "\nend\nend"
    end
  end

  add_blocks(layout.columns, function(column, n)
    add("local c$N, s$N", column.name, n)
    add("getters[$S] = function(...) " .. getter_text[column.type] .. " end", column.name, n)
    if column.writable then
      add("setters[$S] = function(...) local x = ...\n" .. setter_text[column.type] .. "\nend", column.name, n)
    end
    local line = ("c%s, s%s = cast(%s, chunk.columns[%s].data), tonumber(chunk.columns[%s].stride)"):format(n, n,
      pointer_type[column.type], n, n)
    return column.name == "id" and line .. (" id_column, id_stride = c%s, s%s"):format(n, n) or line
  end)
  text[#text + 1] = [[
if not getters.dt then getters.dt = function(...) return frame.dt end end
getters.index = function(...) return first + cursor.i + 1 end
local within, join, leave = {}, {}, {}
]]
  -- Groups by name: closures, chosen when the name is looked up.
  add_blocks(layout.groups, function(group, n)
    add("local g$N, t$N", group.name, n)
    add("within[$S] = function(...) return g$N[cursor.i * t$N] ~= 0 end", group.name, n)
    if group.writable then
      add("join[$S] = function(...) g$N[cursor.i] = 1 end", group.name, n)
      add("leave[$S] = function(...) g$N[cursor.i] = 0 end", group.name, n)
    end
    return ("g%s, t%s = cast(bytes, chunk.groups[%s].data), tonumber(chunk.groups[%s].stride)"):format(n, n, n, n)
  end)
  text[#text + 1] = [[
function methods.within(...)
  local _, name = ...
  if cursor.i < 0 then dead() end
  local ask = within[name]
  if ask == nil then return false end
  local member = ask()
  return member
end
function methods.join(...)
  local _, name = ...
  if cursor.i < 0 then dead() end
  local act = join[name]
  if not act then refuse.group(name, "join") end
  act()
end
function methods.leave(...)
  local _, name = ...
  if cursor.i < 0 then dead() end
  local act = leave[name]
  if not act then refuse.group(name, "leave") end
  act()
end
]]
  text[#text + 1] = text_methods
  if layout.action then text[#text + 1] = text_step end
  -- Vararg, so that no trace starts here, nor in run(): the conversion of a pointer is not compiled.
  text[#text + 1] = [[
local function begin(...)
  local chunk = ...
  first, random = tonumber(chunk.first), chunk.random
  frame = frame_type(chunk.number, chunk.time, chunk.dt)
  shown.details = details
  kill, result, members = chunk.kill, chunk.result, chunk.members
  substep, times, steps = chunk.substep, chunk.times, chunk.steps
  setup(chunk)
end
]]

  local body = layout.predicate and "result[k] = kernel(p, frame, params) and 1 or 0"
    or layout.action and "kernel(p, step, params)" or "kernel(p, frame, params)"
  local test = layout.masked and "if members[k] ~= 0 then cursor.i = k " .. body .. " end" or "cursor.i = k " .. body
  text[#text + 1] = [[
local function run(...)
  local pointer = ...
  local chunk = cast(chunks, pointer)
  begin(chunk)
  for k = 0, tonumber(chunk.size) - 1 do ]] .. test .. [[ end
  cursor.i = -1
end
local function at()
  local place = cursor.i
  cursor.i = -1
  return place < 0 and -1 or first + place
end
local function set_params(values, detail_values)
  details = detail_values
  for _, value in next, values do
    if type(value) == "userdata" then adopt(value) end
  end
  setmetatable(values, { __index = function(_, name) refuse.param(name, values) end })
  params = newproxy(true) -- no table: table.insert would write into it
  local of_params = getmetatable(params)
  of_params.__index, of_params.__metatable = values, false
  of_params.__newindex = function(_, name) refuse.assign(name) end
end
jit.off(set_params) -- once a pass
return run, at, set_params
]]
  local refuse = { wrong_type = wrong_type, not_finite = not_finite, not_whole = not_whole, missing = missing }
  function refuse.write(name, getters)
    if layout.predicate then error(("assigns %q; a test must not change its point"):format(words.name(name)), 0) end
    if name == "id" or name == "dt" or name == "index" then error(("%s is read only"):format(name), 0) end
    if getters[name] then
      error(("assigns %q under a computed name; name it as a constant somewhere in the kernel"):format(name), 0)
    end
    error(("no attribute %q; add :attribute{ %s = 0 } before it"):format(words.name(name), words.name(name)), 0)
  end
  function refuse.param(name, values)
    error(("no parameter %q; the node has %s"):format(words.name(name), table.concat(sorted_names(values), ", ")), 0)
  end
  function refuse.assign(name)
    error(("params.%s can't be assigned; parameters are the graph's"):format(words.name(name)), 0)
  end
  function refuse.group(name, what)
    error(("can't %s the group %s; a kernel names the groups that it joins and leaves as constants: p:%s \"old\"")
      :format(what, describe(name), what), 0)
  end
  function refuse.step(name)
    error(("the step has no %q; it has time, dt, index and detail"):format(words.name(name)), 0)
  end
  function refuse.use(wanted, value)
    error(("p:rand takes %s, not %s"):format(wanted, describe(value)), 0)
  end
  local chunk = assert(loadstring(table.concat(text, "\n"), "=[rapid runner]"))
  return chunk(ffi, vec3, quat, kernel, pointers.frame_type, pointers.rand, pointers.adopt, pointers.shown, refuse,
    layout)
end

-- rand: a light userdata, the function that draws; adopt(object): makes a shape known to traces (lua/shape.lua).
local function prepare(rand, adopt)
  -- The detail values that frame.detail and step.detail show: those of the pass that runs.
  local shown = { details = {} }
  shown.view = newproxy(true) -- no table: table.insert would write into it
  local of_view = getmetatable(shown.view)
  of_view.__metatable = false
  of_view.__tostring = function() return "the detail values" end
  of_view.__index = function(...)
    local _, name = ...
    local value = shown.details[name]
    if value == nil then
      local names = sorted_names(shown.details)
      name = words.name(name)
      error(("no detail value %q; %s"):format(name, #names > 0 and "there are " .. table.concat(names, ", ")
        or "a :detail node sets one: points.detail." .. name .. " = 0"), 0)
    end
    return value
  end
  of_view.__newindex = function(_, name)
    name = words.name(name)
    error(("detail.%s can't be assigned in a kernel; points.detail.%s can, in :detail"):format(name, name), 0)
  end

  local frame_type = ffi.typeof "struct { const double number, time, dt; }"
  ffi.metatype(frame_type, {
    __tostring = function(frame) return ("frame %g"):format(frame.number) end,
    __index = function(...)
      local _, name = ...
      if name == "detail" then return shown.view end
      error(("the frame has no %q; it has number, time, dt and detail"):format(words.name(name)), 2)
    end,
  })
  local pointers = { frame_type = frame_type, rand = ffi.cast("rapid_rand", rand), adopt = adopt, shown = shown }
  return {
    frame = function(number, time, dt, details)
      shown.details = details or {}
      return frame_type(number, time, dt)
    end,
    runner = function(kernel, layout) return make_runner(kernel, layout, pointers) end,
    rand = pointers.rand,
  }
end

return { prepare = prepare }
