-- What a kernel does, read from its bytecode before it runs.
--
-- An abstract interpretation over the instructions of a function: each register holds the kernel's point, a constant
-- string, a method of the point, a value that is shared with other points (it came from an upvalue or a global), or
-- something unknown. Where two ways meet, unequal values become unknown (or stay shared). The result:
--
--   reads, writes    names indexed on the point itself
--   may              names indexed anywhere in helpers, and on values that are not known to be no point
--   joins, asks      groups that it joins or leaves, and that it asks for, where named by constants; in helpers these
--                    are the calls of a method `join` of anything
--   computes_names   whether it indexes the point, or what may be it, by what is no constant
--   asks_places      whether it may ask a point for its place: whether it says `index` of anything, or indexes by what
--                    is no constant what is not known
--   calls            names on the point itself that it calls as if they were methods
--   kills            whether `kill` is called or could be
--   stores           places (line, source, message) where it writes upvalues, globals, shared tables or parameters
--
-- Helpers are the functions that it can reach through upvalues, globals and tables of them, metatables included, as
-- they are when the graph file has run. They are followed with what they are called with, and what they return.
-- Not followed is what lies in the tables that a kernel makes: `rapid check --races` runs it to see.
local bit = require "bit"
local util = require "jit.util"
local vmdef = require "jit.vmdef"

local band, rshift = bit.band, bit.rshift
local getupvalue = debug.getupvalue

local names = {}
for op = 0, #vmdef.bcnames / 6 - 1 do
  names[op] = vmdef.bcnames:sub(op * 6 + 1, op * 6 + 6):gsub("%s", "")
end

-- Each writes no register although its first operand is one.
local conditional = {}
for _, name in ipairs { "ISLT", "ISGE", "ISLE", "ISGT", "ISEQV", "ISNEV", "ISEQS", "ISNES", "ISEQN", "ISNEN", "ISEQP",
                        "ISNEP", "ISTC", "ISFC", "IST", "ISF" } do
  conditional[name] = true
end

local point = { kind = "point" }
local shared = { kind = "shared" } -- of unknown value
local parameters = { kind = "shared", value = {} } -- of a Lua node

local methods = { join = true, leave = true, within = true, kill = true, rand = true }

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

-- The table or function behind a shared value's field, without running metamethods.
local function field(value, name, depth)
  if type(value) ~= "table" or name == nil then return nil end
  local found = rawget(value, name)
  local meta = debug.getmetatable(value)
  if found ~= nil or not meta or depth == 10 then return found end
  return field(rawget(meta, "__index"), name, (depth or 0) + 1)
end

local analyse_function

-- What the upvalue of a function holds: { kind = "shared", value } or, where it is a local of the kernel around a
-- closure, nil. A closure that the kernel makes does not exist yet; its upvalues are told from the kernel's own by
-- name.
local function upvalue_of(f, place, outer)
  if type(f) == "function" then
    local _, value = getupvalue(f, place + 1)
    return { kind = "shared", value = value }
  end
  return outer and outer(util.funcuvname(f, place))
end

-- The same by name, for the closures that f makes.
local function upvalues_by_name(f, outer)
  return function(name)
    for place = 0, util.funcinfo(f).upvalues - 1 do
      if util.funcuvname(f, place) == name then return upvalue_of(f, place, outer) end
    end
    return nil
  end
end

-- Functions of Lua that write into an argument, by its place from 1.
local writers = {
  [table.insert] = { "table.insert", 1 }, [table.remove] = { "table.remove", 1 }, [table.sort] = { "table.sort", 1 },
  [table.move] = { "table.move", 5 },
}

-- Native functions that give back what they are given, or what lies in it. `pairs` and `next` are ours.
local handing_on = { [ipairs] = true, [unpack] = true, [select] = true, [assert] = true, [setmetatable] = true }

-- All other native functions that graph code finds; any further one is an iterator that it has made.
local library = {}
for _, functions in ipairs { _G, string, math, table, coroutine, bit } do
  for _, f in pairs(functions) do library[f] = true end
end

-- Whether a function of the sandbox stands for one that hands on: they are Lua, so known by name.
local function hands_on(f, env)
  return handing_on[f] or f == rawget(env, "pairs") or f == rawget(env, "next") or f == rawget(env, "setmetatable")
end

-- The functions that a shared table holds, and those of its metatable: indexing it by a name that is not known, going
-- over it, or an operator may call them.
local function analyse_inside(value, found)
  if type(value) ~= "table" or found.inside[value] then return end
  found.inside[value] = true
  for _, map in ipairs { value, debug.getmetatable(value) or nil } do
    for _, element in next, map do
      if type(element) == "function" then analyse_function(element, found) end
    end
  end
end

-- One pass of instructions from `pc` with the registers `regs`; returns the successors. Findings go to `found`.
local function step(f, pc, regs, found, outer, call)
  local ins, mode = util.funcbc(f, pc)
  if not ins then return {} end
  local name = names[band(ins, 0xff)]
  local a, b, c, d = band(rshift(ins, 8), 0xff), rshift(ins, 24), band(rshift(ins, 16), 0xff), rshift(ins, 16)
  local writes_a = band(mode, 7) == 1
  local result, over_shared

  local function line()
    return util.funcinfo(f, pc).currentline
  end
  local function refuse(message)
    found.stores[#found.stores + 1] = { line = line(), source = util.funcinfo(f).source, message = message }
  end
  local function store(what)
    refuse(("the kernel %s; %s"):format(what, found.remedy))
  end
  local function index_read(object, key)
    if key == "index" then found.asks_places = true end
    if object == point then
      if methods[key] then
        if key == "kill" then found.kills = true end
        return { kind = "method", value = key }
      end
      found.reads[key] = found.reads[key] or line()
      return { kind = "attribute", value = key }
    elseif object and object.kind == "shared" then
      return { kind = "shared", value = field(object.value, key) }
    else
      found.may[key] = true
      if key == "kill" then found.kills = true end
      if methods[key] then return { kind = "method", value = key, of_unknown = true } end
    end
    return nil
  end

  if name == "MOV" then
    result = regs[d]
  elseif name == "KSTR" then
    result = { kind = "string", value = string_constant(f, d) }
    if result.value == "index" then found.asks_places = true end
  elseif name == "UGET" then
    result = upvalue_of(f, d, outer)
  elseif name == "GGET" then
    local key = string_constant(f, d)
    result = { kind = "shared", value = rawget(found.env, key) }
  elseif name == "TGETS" then
    result = index_read(regs[b], string_constant(f, c))
  elseif name == "TGETV" or name == "TGETB" or name == "TGETR" then
    local object, key = regs[b], regs[c]
    if name == "TGETV" and key and key.kind == "string" then
      result = index_read(object, key.value)
    elseif object and object.kind == "shared" then
      if name == "TGETV" and object.value == nil then found.asks_places = true end
      analyse_inside(object.value, found)
      result = { kind = "shared", value = name == "TGETB" and field(object.value, c) or nil }
    elseif name == "TGETV" and (not object or object == point) then
      found.computes_names = true
    end
  elseif name == "TSETS" then
    local object, key = regs[b], string_constant(f, c)
    if object == point then
      found.writes[key] = found.writes[key] or line()
    elseif object == parameters then
      refuse(("params.%s can't be assigned; parameters are the graph's"):format(key))
    elseif object and object.kind == "shared" then
      store(("assigns the field %q of a table that all points share"):format(key))
    else
      found.may[key] = true
      found.may_write[key] = true
    end
  elseif name == "TSETV" or name == "TSETB" or name == "TSETR" or name == "TSETM" then
    local object = regs[b]
    if name == "TSETM" then object = regs[a - 1] end
    local key = name == "TSETV" and regs[c] or nil
    if object == point and key and key.kind == "string" then
      found.writes[key.value] = found.writes[key.value] or line()
    elseif object and object ~= parameters and object.kind == "shared" then
      store("assigns into a table that all points share")
    end
  elseif name == "USETV" or name == "USETS" or name == "USETN" or name == "USETP" then
    if upvalue_of(f, a, outer) then store(("assigns the upvalue %q"):format(util.funcuvname(f, a))) end
  elseif name == "GSET" then
    store(("assigns the global %q"):format(string_constant(f, d)))
  elseif name == "FNEW" then
    local child = util.funck(f, -d - 1)
    if child then
      result = { kind = "closure", value = child, outer = upvalues_by_name(f, outer) }
      analyse_function(child, found, nil, result.outer)
    end
  elseif name == "CALL" or name == "CALLM" or name == "CALLT" or name == "CALLMT" then
    local callee, first = regs[a], a + 2 -- two slots a frame
    local arguments = name == "CALL" and c - 1 or name == "CALLM" and c or name == "CALLT" and d - 1 or d
    local given = {} -- of what all points share, by place from 0
    for place = 0, arguments - 1 do
      local argument = regs[first + place]
      if argument and argument.kind == "shared" then given[place] = argument end
    end
    if callee and callee.kind == "method" and (callee.value == "join" or callee.value == "leave") then
      local group = regs[first + 1]
      if group and group.kind == "string" then
        found.joins[group.value] = true
      elseif not callee.of_unknown then
        found.computed_group = found.computed_group or line()
      end
    elseif callee and callee.kind == "method" and callee.value == "within" then
      local group = regs[first + 1]
      if group and group.kind == "string" then found.asks[group.value] = true else found.asks_any = true end
    elseif callee and callee.kind == "attribute" then
      found.calls[callee.value] = found.calls[callee.value] or line()
    elseif callee and callee.kind == "closure" then
      result = analyse_function(callee.value, found, given, callee.outer)
    elseif callee and callee.kind == "shared" and type(callee.value) == "function" then
      local called = callee.value
      local writer = writers[called]
      result = analyse_function(called, found, given)
      if writer and given[arguments >= writer[2] and writer[2] - 1 or 0] then
        store(("changes a table that all points share by %s"):format(writer[1]))
      elseif hands_on(called, found.env) then
        for _, argument in pairs(given) do
          analyse_inside(argument.value, found)
          result = shared
        end
      elseif found.resumes(called, given[0]) or not library[called] and not util.funcinfo(called).bytecodes then
        store "resumes a coroutine, or an iterator, that was made outside of it"
      end
    end
    for slot = a, a + 250 do regs[slot] = nil end
    if result then
      for slot = a, a + math.max(b - 2, 0) do regs[slot] = shared end
      regs[a] = result
    end
  elseif name == "ITERC" or name == "ITERN" then
    -- of pairs(t): the iterator, t and the last key lie before it
    if regs[a - 2] and regs[a - 2].kind == "shared" then over_shared = true end
  end

  -- A shared function that is passed on, or kept in a local, may be called by whoever gets it.
  -- So may those of a table's metatable, by an operator.
  if result and result.kind == "shared" then
    if type(result.value) == "function" then analyse_function(result.value, found) end
    if type(result.value) == "table" and debug.getmetatable(result.value) then analyse_inside(result.value, found) end
  end

  if writes_a then
    regs[a] = result
  elseif name == "KNIL" then
    for slot = a, d do regs[slot] = nil end
  elseif name == "VARG" or name == "ITERC" or name == "ITERN" or name == "TNEW" then
    for slot = a, a + 250 do regs[slot] = nil end
    if over_shared then regs[a], regs[a + 1] = shared, shared end
  elseif name == "FORI" or name == "FORL" or name == "IFORL" then
    regs[a + 3] = nil
  end

  if name:find "^RET" then
    for slot = a, name == "RETM" and a + 250 or a + d - 2 do
      if regs[slot] and regs[slot].kind == "shared" then call.returned = regs[slot] end
    end
  elseif name == "CALLT" or name == "CALLMT" then
    if result and result.kind == "shared" then call.returned = result end
  end

  local target = pc + d - 0x7fff
  if name:find "^RET" or name == "CALLT" or name == "CALLMT" then return {} end
  if name == "JMP" or name == "ISNEXT" then return { target } end
  if name == "UCLO" then return { target } end
  if conditional[name] then return { pc + 1, pc + 2 } end
  if name == "FORI" or name == "FORL" or name == "IFORL" or name == "ITERL" or name == "IITERL" then
    return { pc + 1, target }
  end
  return { pc + 1 }
end

local most_calls = 8 -- of one helper, with shared values of its own; further ones are looked at together

-- What is known of f, called with these shared values: { given, returned }, and whether it is new.
local function call_of(f, given, found)
  local calls = found.calls_of[f] or {}
  found.calls_of[f] = calls
  if #calls == most_calls then
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

-- f: a function, or the prototype of one that a kernel makes; given: what is known of its arguments, by place from 0;
-- outer: of a prototype, what finds the upvalues of the functions around it by name. Returns what f returns, if all
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

local to_remember = {
  point = "kernels run in parallel, in states of their own: keep it in an attribute of the point, or do it once for " ..
    "the whole set in :detail",
  set = "a frame depends on the points that enter it, and nothing else: keep it in a detail value, " ..
    "points.detail.NAME = value",
}

-- env: the environment in which the kernel's globals live; resumes(f, first): whether calling f goes on with a
-- coroutine; of_a_point: the kernel's first parameter is a point.
local function analyse(kernel, env, resumes, of_a_point)
  local found = {
    reads = {}, writes = {}, may = {}, may_write = {}, joins = {}, asks = {}, calls = {}, stores = {}, calls_of = {},
    inside = {}, env = env, resumes = resumes, remedy = of_a_point and to_remember.point or to_remember.set,
  }
  -- Behind the point and the frame come the parameters of a Lua node, which all points share.
  analyse_function(kernel, found, of_a_point and { [0] = point, [2] = parameters } or { [2] = parameters })
  found.calls_of, found.inside, found.env, found.resumes, found.remedy = nil, nil, nil, nil, nil
  return found
end

-- Instructions and constants, as text: equal for the same function in two states. Tables of constants are left out:
-- their order differs from state to state.
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

-- The line of the last call in tail position, `return f()`: such a call leaves no frame behind that would tell it.
local function tail_call_line(f)
  for pc = util.funcinfo(f).bytecodes - 1, 1, -1 do
    local name = names[band(util.funcbc(f, pc), 0xff)]
    if name == "CALLT" or name == "CALLMT" then return util.funcinfo(f, pc).currentline end
  end
end

return { analyse = analyse, fingerprint = fingerprint, tail_call_line = tail_call_line }
