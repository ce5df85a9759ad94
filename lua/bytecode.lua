-- Analysis of a kernel: its effects, read from its bytecode before it runs.
--
-- An abstract interpretation over the instructions of a function: each register holds the kernel's point, a constant
-- string, a method of the point, a value shared with other points (it came from an upvalue or a global), or something
-- unknown. If two paths that meet hold unequal values, the result is unknown (or stays shared). The result:
--
--   reads, writes    names indexed on the point itself
--   may              names indexed anywhere in helpers, and on values that may be the point; for a function of the
--                    whole set also its strings, which may name attributes
--   joins, queries   groups that it joins or leaves, and that it queries, if constants name them; in helpers, calls of
--                    a method `join` of any object
--   computes_names   true if it indexes the point, or a value that may be the point, by a computed name
--   reads_indices    true if it may read a point's `index`: it uses this name, or indexes an unknown value by a
--                    computed name
--   calls            names on the point itself that it calls like methods
--   kills            true if `kill` is called or could be
--   reads_points     for a function of the whole set: true if it may use its points for more than points.detail
--   vectors          attributes to which it assigns vec3(...) or quat(...), with the number of components
--   stores           places (line, source, message) where it writes upvalues, globals, shared tables or parameters
--
-- Helpers are the functions that it can reach through upvalues, globals and tables of them, metatables included, as
-- they are after the graph file has run. Their arguments and results are followed, too. Values in tables that a kernel
-- makes are not followed: `rapid check --races` finds these by running it.
local bit = require "bit"
local protected = require "protected"
local util = require "jit.util"
local vmdef = require "jit.vmdef"

local band, rshift = bit.band, bit.rshift
local getupvalue = debug.getupvalue

local names = {}
for op = 0, #vmdef.bcnames / 6 - 1 do
  names[op] = vmdef.bcnames:sub(op * 6 + 1, op * 6 + 6):gsub("%s", "")
end

-- Instructions that write no register although their first operand is one.
local conditional = {}
for _, name in ipairs { "ISLT", "ISGE", "ISLE", "ISGT", "ISEQV", "ISNEV", "ISEQS", "ISNES", "ISEQN", "ISNEN", "ISEQP",
                        "ISNEP", "ISTC", "ISFC", "IST", "ISF" } do
  conditional[name] = true
end

local point = { kind = "point" }
local shared = { kind = "shared" } -- the value is unknown
local parameters = { kind = "shared", value = {} } -- the parameters of a Lua node
local set = { kind = "set" } -- all points, in a :detail function

local function join(a, b)
  if a == b then return a end
  if a and b and a.kind == b.kind and a.value == b.value then return a end
  if (a and a.kind == "shared") or (b and b.kind == "shared") then return shared end
  return nil
end

local function string_constant(f, index)
  local value = util.funck(f, -index - 1)
  return type(value) == "string" and value or nil
end

-- Returns the table or function in a field of a shared value, without running metamethods.
local function field(value, name, depth)
  if type(value) ~= "table" or name == nil then return nil end
  local found = rawget(value, name)
  local meta = debug.getmetatable(value)
  if found ~= nil or not meta or depth == 10 then return found end
  return field(rawget(meta, "__index"), name, (depth or 0) + 1)
end

local analyse_function

-- The results of vec3 and quat, by their number of components.
local vectors = { [3] = { kind = "vector", size = 3 }, [4] = { kind = "vector", size = 4 } }

-- Returns the value of a function's upvalue: { kind = "shared", value }, or nil if it is a local of the kernel that
-- encloses a closure. A closure that the kernel makes does not exist yet; its upvalues are distinguished from the
-- kernel's own by name.
local function upvalue_of(f, place, outer)
  if type(f) == "function" then
    local _, value = getupvalue(f, place + 1)
    return { kind = "shared", value = value }
  end
  return outer and outer(util.funcuvname(f, place))
end

-- Returns the same lookup by name, for the closures that f makes.
local function upvalues_by_name(f, outer)
  return function(name)
    for place = 0, util.funcinfo(f).upvalues - 1 do
      if util.funcuvname(f, place) == name then return upvalue_of(f, place, outer) end
    end
    return nil
  end
end

-- Lua functions that write into an argument, with the argument's position from 1.
local writers = {
  [table.insert] = { "table.insert", 1 }, [table.remove] = { "table.remove", 1 },
  [protected.sort] = { "table.sort", 1 },
  [table.move] = { "table.move", 5 },
}

-- Native functions that return their arguments, or elements of them. `pairs` and `next` are the sandbox's.
local handing_on = { [ipairs] = true, [unpack] = true, [select] = true, [assert] = true, [setmetatable] = true }

-- Returns the name of a writing function and the position from 1 of the argument that a call of f writes into, or nil
-- for other functions.
local function writer_of(f, env)
  if f == rawget(env, "setmetatable") then return { "setmetatable", 1 } end
  return writers[f]
end

-- All other native functions that graph code can reach; any further one is an iterator that it has made.
local library = {}
for _, functions in ipairs { _G, string, math, table, coroutine, bit } do
  for _, f in pairs(functions) do library[f] = true end
end

-- Returns true if a function passes its arguments on. The sandbox's own are written in Lua, so they are known by name.
local function hands_on(f, env)
  return handing_on[f] or f == rawget(env, "pairs") or f == rawget(env, "next") or f == rawget(env, "setmetatable")
end

-- Analyses the functions in a shared table and in its metatable: an index by an unknown name, an iteration or an
-- operator may call them.
local function analyse_inside(value, found)
  if type(value) ~= "table" or found.inside[value] then return end
  found.inside[value] = true
  for _, map in ipairs { value, debug.getmetatable(value) or nil } do
    for _, element in next, map do
      if type(element) == "function" then analyse_function(element, found) end
    end
  end
end

-- An instruction and the facts known there: f and pc; the operands a, b, c, d; the registers; the findings so far;
-- `outer` as in analyse_function(); the call that is being followed.
local At = {}
At.__index = At

function At:line()
  return util.funcinfo(self.f, self.pc).currentline
end

function At:string_constant(index)
  return string_constant(self.f, index)
end

function At:refuse(message)
  local stores = self.found.stores
  stores[#stores + 1] = { line = self:line(), source = util.funcinfo(self.f).source, message = message }
end

function At:refuse_store(what)
  self:refuse(("%s %s; %s"):format(self.found.subject, what, self.found.remedy))
end

-- Records the line and file of the first mention of a name.
function At:mention(map, name)
  map[name] = map[name] or self:line()
  local locations = self.found.locations
  locations[name] = locations[name] or { line = self:line(), source = util.funcinfo(self.f).source }
end

-- Reads object.key or object[key] with a constant key.
function At:read_field(object, key)
  local found = self.found
  if key == "index" then found.reads_indices = true end
  if object == point then
    if found.methods[key] then
      if key == "kill" then found.kills = true end
      return { kind = "method", value = key }
    end
    self:mention(found.reads, key)
    return { kind = "attribute", value = key }
  elseif object and object.kind == "shared" then
    return { kind = "shared", value = field(object.value, key) }
  end
  found.may[key] = true
  if key == "kill" then found.kills = true end
  if found.methods[key] then return { kind = "method", value = key, of_unknown = true } end
end

-- Reads object[key] with a number or a varying value as key; `key` is the number, if it is known.
function At:read_element(object, key)
  if object and object.kind == "shared" then
    analyse_inside(object.value, self.found)
    return { kind = "shared", value = key and field(object.value, key) or nil }
  end
end

function At:write_element(object)
  if object and object ~= parameters and object.kind == "shared" then
    self:refuse_store "assigns into a table that all points share"
  end
end

-- Kinds of operands in vmdef.bcmode.
local variable, base = 3, 2

local returns = { RET = true, RET1 = true, RETM = true }

-- Returns true if the instruction does more with the set than copy it into another register or find points.detail.
function At:reads_set(name, mode)
  if name == "MOV" or name == "TGETS" and self:string_constant(self.c) == "detail" then return false end
  local regs = self.regs
  local has_d = band(rshift(mode, 3), 15) == 0 -- one operand instead of b and c
  for _, operand in ipairs { { band(mode, 7), self.a }, { band(rshift(mode, 3), 15), self.b },
                             { band(rshift(mode, 7), 15), has_d and self.d or self.c } } do
    local kind, slot = operand[1], operand[2]
    if kind == variable and regs[slot] == set then return true end
    if kind == base or returns[name] and slot == self.a then
      for higher = slot, 250 do
        if regs[higher] == set then return true end
      end
    end
  end
  return name == "FNEW" -- a closure may see it
end

function At:forget(first, last)
  for slot = first, last do self.regs[slot] = nil end
end

-- Effects of instructions by opcode. An effect returns the value of its first operand's register, or of its call.
local effects = {}

-- Sets the same effect for several opcodes.
local function on(names_of_ops, effect)
  for _, name in ipairs(names_of_ops) do effects[name] = effect end
end

function effects.MOV(at)
  return at.regs[at.d]
end

function effects.KSTR(at)
  local text = at:string_constant(at.d)
  if text == "index" then at.found.reads_indices = true end
  if at.found.of_the_set and text then at.found.may[text] = true end -- points:max "age"
  return { kind = "string", value = text }
end

function effects.UGET(at)
  return upvalue_of(at.f, at.d, at.outer)
end

function effects.GGET(at)
  return { kind = "shared", value = rawget(at.found.env, at:string_constant(at.d)) }
end

function effects.TGETS(at)
  return at:read_field(at.regs[at.b], at:string_constant(at.c))
end

function effects.TGETV(at)
  local object, key = at.regs[at.b], at.regs[at.c]
  if key and key.kind == "string" then return at:read_field(object, key.value) end
  if not object or object == point then
    at.found.computes_names = true
  elseif object.kind == "shared" and object.value == nil then
    at.found.reads_indices = true
  end
  return at:read_element(object)
end

function effects.TGETB(at)
  return at:read_element(at.regs[at.b], at.c)
end

function effects.TGETR(at)
  return at:read_element(at.regs[at.b])
end

function effects.TSETS(at)
  local object, key, value = at.regs[at.b], at:string_constant(at.c), at.regs[at.a]
  local found = at.found
  if key == "__newindex" and value and value.kind == "shared" and type(value.value) ~= "function" then
    at:refuse_store "makes a table that all points share the __newindex of another"
  end
  if object == point then
    at:mention(found.writes, key)
    if value and value.kind == "vector" then found.vectors[key] = value.size end
  elseif object == parameters then
    at:refuse(("params.%s can't be assigned; parameters are set by the graph"):format(key))
  elseif object and object.kind == "shared" then
    at:refuse_store(("assigns the field %q of a table that all points share"):format(key))
  else
    found.may[key] = true
    found.may_write[key] = true
  end
end

function effects.TSETV(at)
  local object, key = at.regs[at.b], at.regs[at.c]
  if object == point and key and key.kind == "string" then
    at:mention(at.found.writes, key.value)
  else
    at:write_element(object)
  end
end

on({ "TSETB", "TSETR" }, function(at)
  at:write_element(at.regs[at.b])
end)

function effects.TSETM(at)
  at:write_element(at.regs[at.a - 1])
end

on({ "USETV", "USETS", "USETN", "USETP" }, function(at)
  if upvalue_of(at.f, at.a, at.outer) then
    at:refuse_store(("assigns the upvalue %q"):format(util.funcuvname(at.f, at.a)))
  end
end)

function effects.GSET(at)
  at:refuse_store(("assigns the global %q"):format(at:string_constant(at.d)))
end

function effects.FNEW(at)
  local child = util.funck(at.f, -at.d - 1)
  if not child then return nil end
  local outer = upvalues_by_name(at.f, at.outer)
  analyse_function(child, at.found, nil, outer)
  return { kind = "closure", value = child, outer = outer }
end

-- Handlers by method name: each records how a method of the point uses the group passed to it.
local group_calls = {}

function group_calls.join(at, callee, group)
  if group and group.kind == "string" then
    at.found.joins[group.value] = true
  elseif not callee.of_unknown then
    at.found.computed_group = at.found.computed_group or at:line()
  end
end
group_calls.leave = group_calls.join

function group_calls.within(at, _, group)
  if group and group.kind == "string" then
    at.found.queries[group.value] = true
  else
    at.found.queries_any_group = true
  end
end

-- Follows a call of a shared function with these shared values. Returns its result if all points share it.
local function call_shared(at, called, given, arguments)
  local found = at.found
  local writer = writer_of(called, found.env)
  local result = analyse_function(called, found, given)
  local written = writer and given[arguments >= writer[2] and writer[2] - 1 or 0]
  if written and (written.value == nil or type(written.value) == "table") then
    at:refuse_store(("changes a table that all points share by %s"):format(writer[1]))
  elseif hands_on(called, found.env) then
    for _, argument in pairs(given) do
      analyse_inside(argument.value, found)
      result = shared
    end
  elseif protected.resumes(called, given[0]) or not library[called] and not util.funcinfo(called).bytecodes then
    at:refuse_store "resumes a coroutine or an iterator that was made outside it"
  end
  return result
end

-- Follows a call of `callee`, whose arguments lie in registers from `first` on. Returns its result if all points share
-- it.
local function call_value(at, callee, first, arguments)
  local regs = at.regs
  local given = {} -- arguments that all points share, by position from 0
  for place = 0, arguments - 1 do
    local argument = regs[first + place]
    if argument and argument.kind == "shared" then given[place] = argument end
  end
  if not callee then return nil end
  if callee.kind == "method" then
    local of_group = group_calls[callee.value]
    if of_group then of_group(at, callee, regs[first + 1]) end
  elseif callee.kind == "attribute" then
    at:mention(at.found.calls, callee.value)
  elseif callee.kind == "closure" then
    return analyse_function(callee.value, at.found, given, callee.outer)
  elseif callee.kind == "shared" and type(callee.value) == "function" then
    local behind = protected.place_of_arguments(callee.value)
    if behind then return call_value(at, regs[first], first + behind, arguments - behind) end
    return call_shared(at, callee.value, given, arguments)
  end
end

local function call_function(at, arguments)
  local regs = at.regs
  local callee = regs[at.a]
  local made = callee and callee.kind == "shared" and callee.value ~= nil and at.found.constructors[callee.value]
  local result = call_value(at, callee, at.a + 2, arguments) -- two slots a frame
  at:forget(at.a, at.a + 250)
  if result then
    for slot = at.a, at.a + math.max(at.b - 2, 0) do regs[slot] = shared end
    regs[at.a] = result
  elseif made then
    regs[at.a] = made
    return made
  end
  return result
end

function effects.CALL(at) return call_function(at, at.c - 1) end
function effects.CALLM(at) return call_function(at, at.c) end
function effects.CALLT(at) return call_function(at, at.d - 1) end
function effects.CALLMT(at) return call_function(at, at.d) end

function effects.KNIL(at)
  at:forget(at.a, at.d)
end

function effects.VARG(at)
  at:forget(at.a, at.a + 250)
end

-- pairs(t): the three registers before hold the iterator, t and the last key.
on({ "ITERC", "ITERN" }, function(at)
  local map = at.regs[at.a - 2]
  at:forget(at.a, at.a + 250)
  if map and map.kind == "shared" then at.regs[at.a], at.regs[at.a + 1] = shared, shared end
end)

on({ "FORI", "FORL", "IFORL" }, function(at)
  at.regs[at.a + 3] = nil
end)

local function return_values(at, last)
  for slot = at.a, last do
    local value = at.regs[slot]
    if value and value.kind == "shared" then at.call.returned = value end
  end
end
on({ "RET", "RET0", "RET1" }, function(at) return_values(at, at.a + at.d - 2) end)
function effects.RETM(at) return_values(at, at.a + 250) end

local tail_calls = { CALLT = true, CALLMT = true }

-- Follows a shared function that is passed on or stored in a local, since its receiver may call it. The functions of a
-- table's metatable are followed too, since an operator may call them.
local function follow(value, found)
  if not value or value.kind ~= "shared" then return end
  if type(value.value) == "function" then analyse_function(value.value, found) end
  if type(value.value) == "table" and debug.getmetatable(value.value) then analyse_inside(value.value, found) end
end

-- Returns the positions of the instructions that may come next.
local function successors(name, pc, target)
  if name:find "^RET" or tail_calls[name] then return {} end
  if name == "JMP" or name == "ISNEXT" or name == "UCLO" then return { target } end
  if conditional[name] then return { pc + 1, pc + 2 } end
  if name == "FORI" or name == "FORL" or name == "IFORL" or name == "ITERL" or name == "IITERL" then
    return { pc + 1, target }
  end
  return { pc + 1 }
end

-- Runs the instruction at `pc` on the registers; returns its successors.
local function step(f, pc, regs, found, outer, following)
  local ins, mode = util.funcbc(f, pc)
  if not ins then return {} end
  local name = names[band(ins, 0xff)]
  local at = setmetatable({
    f = f, pc = pc, regs = regs, found = found, outer = outer, call = following,
    a = band(rshift(ins, 8), 0xff), b = rshift(ins, 24), c = band(rshift(ins, 16), 0xff), d = rshift(ins, 16),
  }, At)
  if found.of_the_set and at:reads_set(name, mode) then found.reads_points = true end
  local effect = effects[name]
  local result
  if effect then result = effect(at) end
  follow(result, found)
  local writes_first = band(mode, 7) == 1 -- its first operand is the register that it writes
  if writes_first then regs[at.a] = result end
  if tail_calls[name] and result and result.kind == "shared" then following.returned = result end
  return successors(name, pc, pc + at.d - 0x7fff)
end

local max_calls = 8 -- distinguished per helper by their shared values; further ones are merged

-- Returns the call of f with these shared values, { given, returned }, and true if it is new.
local function call_of(f, given, found)
  local calls = found.calls_of[f] or {}
  found.calls_of[f] = calls
  if #calls == max_calls then
    local any = {}
    for place in pairs(given) do any[place] = shared end
    given = any
  end
  for _, call in ipairs(calls) do
    local same = true
    for place = 0, 250 do
      local a, b = call.given[place], given[place]
      same = same and (a == b or (a and b and a.value == b.value) or false)
    end
    if same then return call, false end
  end
  local call = { given = given }
  calls[#calls + 1] = call
  return call, true
end

-- Analyses f, a function or the prototype of one that a kernel makes. given: its shared arguments, by position from 0;
-- outer: for a prototype, finds upvalues of the enclosing functions by name. Returns the value that f returns if all
-- points share it.
function analyse_function(f, found, given, outer)
  local info = util.funcinfo(f)
  if not info.bytecodes then return end -- native
  if info.source:find "^=%[rapid" or info.linedefined < 0 then return end -- ours, or LuaJIT's
  local call, is_new = call_of(f, given or {}, found)
  if not is_new then return call.returned end

  local entry = {}
  for place, value in pairs(call.given) do
    if place < info.params then entry[place] = value end
  end
  local states = { [1] = entry }
  local open = { 1 }
  while #open > 0 do
    local pc = table.remove(open)
    local regs = {}
    for slot, value in pairs(states[pc]) do regs[slot] = value end
    for _, next_pc in ipairs(step(f, pc, regs, found, outer, call)) do
      local known = states[next_pc]
      if not known then
        states[next_pc] = {}
        for slot, value in pairs(regs) do states[next_pc][slot] = value end
        open[#open + 1] = next_pc
      else
        local changed = false
        for slot = 0, 255 do
          local joined = join(known[slot], regs[slot])
          if known[slot] ~= regs[slot] and (known[slot] == set or regs[slot] == set) then found.reads_points = true end
          if joined ~= known[slot] then
            known[slot], changed = joined, true
          end
        end
        if changed then open[#open + 1] = next_pc end
      end
    end
  end
  return call.returned
end

local remedies = {
  point = "kernels run in parallel, in several Lua states: store the value in an attribute of the point, or " ..
    "compute it once for " ..
    "all points in a :detail",
  set = "a frame may depend only on the points that enter it: store the value in a detail value, " ..
    "points.detail.NAME = value",
  frame = "a snapshot of %s can't store what a function of the frame remembers: compute it from frame.number, or " ..
    "store it in points.detail.NAME, in a :detail",
}

-- Returns the advice for a kernel that stores a value where it must not.
local function to_remember(of_a_point)
  return of_a_point and remedies.point or remedies.set
end

-- env: the environment of f's globals; remedy, subject: parts of messages.
local function nothing_found(env, remedy, subject, methods)
  local found = {
    reads = {}, writes = {}, may = {}, may_write = {}, joins = {}, queries = {}, calls = {}, stores = {}, calls_of = {},
    inside = {}, env = env, remedy = remedy, subject = subject, methods = {},
    locations = {}, vectors = {}, constructors = {},
  }
  for size, name in pairs { [3] = "vec3", [4] = "quat" } do
    local constructor = rawget(env, name)
    if constructor ~= nil then found.constructors[constructor] = vectors[size] end
  end
  for _, name in ipairs(methods) do found.methods[name] = true end
  return found
end

-- Analyses a kernel. env: the environment of the kernel's globals; of_a_point: the kernel's first parameter is a point;
-- point_names: the table of the host.
local function analyse(kernel, env, of_a_point, point_names)
  local info = util.funcinfo(kernel)
  if not info.bytecodes or info.source:find "^=%[rapid" then
    error("the kernel is a function of Lua's library; write a function in the scene that calls it", 0)
  end
  local found = nothing_found(env, to_remember(of_a_point), "the kernel", point_names.methods)
  -- The parameters of a Lua node follow the point and the frame. All points share them.
  found.of_the_set = not of_a_point
  found.reads_points = found.of_the_set and util.funcinfo(kernel).isvararg or false
  analyse_function(kernel, found, { [0] = of_a_point and point or set, [2] = parameters })
  for _, own in ipairs { "calls_of", "inside", "env", "remedy", "subject", "methods", "of_the_set", "constructors" } do
    found[own] = nil
  end
  return found
end

-- Returns the positions at which a function of the frame stores something for its next call: the `stores` of analyse().
-- cache: the program's name for the setting of snapshots.
local function remembers(f, env, cache)
  local found = nothing_found(env, remedies.frame:format(cache), "a function of the frame", {})
  analyse_function(f, found)
  return { stores = found.stores }
end

-- Returns a constant as a string, equal for equal constants in two states. Tables of constants hold no other values.
local function constant_text(value)
  if type(value) == "number" then return ("%.17g"):format(value) end
  if type(value) ~= "table" then return ("%s %d:%s"):format(type(value), #tostring(value), tostring(value)) end
  local parts = {}
  for key, element in next, value do parts[#parts + 1] = constant_text(key) .. "=" .. constant_text(element) end
  table.sort(parts)
  return "{" .. table.concat(parts, ",") .. "}"
end

-- Returns everything that the body of a file and its functions do, before it runs: a list that alternates the lines
-- where they begin with their instructions and constants as strings, starting with the body. Line numbers inside are
-- left out, since a comment does not change the program.
local function code_of(body)
  local list = {}
  local function add(f)
    local info = util.funcinfo(f)
    local words = { ("%d %d %s"):format(info.params, info.stackslots, tostring(info.isvararg)) }
    local place = #list + 1
    list[place], list[place + 1] = info.linedefined, ""
    for pc = 1, info.bytecodes - 1 do words[#words + 1] = tostring((util.funcbc(f, pc))) end
    for k = 0, info.nconsts - 1 do words[#words + 1] = constant_text(util.funck(f, k)) end
    for k = 0, info.upvalues - 1 do words[#words + 1] = util.funcuvname(f, k) end
    for k = -1, -info.gcconsts, -1 do
      local value = util.funck(f, k)
      if type(value) == "proto" then add(value) else words[#words + 1] = constant_text(value) end
    end
    list[place + 1] = table.concat(words, " ")
  end
  add(body)
  return list
end

-- Returns instructions and constants as a string, equal for the same function in two states. Tables of constants are
-- left out: their order differs from state to state.
local function fingerprint(f)
  local info = util.funcinfo(f)
  local words = { ("%s:%d"):format(info.source, info.linedefined) }
  for pc = 1, info.bytecodes - 1 do words[#words + 1] = tostring((util.funcbc(f, pc))) end
  for k = 0, info.nconsts - 1 do words[#words + 1] = tostring(util.funck(f, k)) end
  for k = -1, -info.gcconsts, -1 do
    local value = util.funck(f, k)
    if type(value) == "string" then words[#words + 1] = value end
    if type(value) == "proto" then words[#words + 1] = fingerprint(value) end
  end
  return table.concat(words, " ")
end

-- Returns the line of the last tail call, `return f()`: such a call leaves no stack frame that would show it.
local function tail_call_line(f)
  for pc = util.funcinfo(f).bytecodes - 1, 1, -1 do
    local name = names[band(util.funcbc(f, pc), 0xff)]
    if name == "CALLT" or name == "CALLMT" then return util.funcinfo(f, pc).currentline end
  end
end

return {
  analyse = analyse, code_of = code_of, fingerprint = fingerprint, remembers = remembers,
  tail_call_line = tail_call_line, to_remember = to_remember,
}
