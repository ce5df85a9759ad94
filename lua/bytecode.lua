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
--   calls            names on the point itself that it calls as if they were methods
--   kills            whether `kill` is called or could be
--   stores           places (line, what) where it writes upvalues, globals or shared tables
--
-- Helpers are the functions that it can reach through upvalues, globals and tables of them, as they are when the graph
-- file has run.
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
local function field(value, name)
  if type(value) == "table" and name ~= nil then return rawget(value, name) end
  return nil
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

-- Functions of Lua that write into their first argument.
local writers = {
  [table.insert] = "table.insert", [table.remove] = "table.remove", [table.sort] = "table.sort",
}

-- One pass of instructions from `pc` with the registers `regs`; returns the successors. Findings go to `found`.
local function step(f, pc, regs, found, outer)
  local ins, mode = util.funcbc(f, pc)
  if not ins then return {} end
  local name = names[band(ins, 0xff)]
  local a, b, c, d = band(rshift(ins, 8), 0xff), rshift(ins, 24), band(rshift(ins, 16), 0xff), rshift(ins, 16)
  local writes_a = band(mode, 7) == 1
  local result

  local function line()
    return util.funcinfo(f, pc).currentline
  end
  local function store(what)
    found.stores[#found.stores + 1] = { line = line(), source = util.funcinfo(f).source, what = what }
  end
  local function index_read(object, key)
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
  elseif name == "UGET" then
    result = upvalue_of(f, d, outer)
  elseif name == "GGET" then
    local key = string_constant(f, d)
    result = { kind = "shared", value = found.env[key] }
  elseif name == "TGETS" then
    result = index_read(regs[b], string_constant(f, c))
  elseif name == "TGETV" or name == "TGETB" or name == "TGETR" then
    local object, key = regs[b], regs[c]
    if name == "TGETV" and key and key.kind == "string" then
      result = index_read(object, key.value)
    elseif object and object.kind == "shared" then
      result = { kind = "shared", value = name == "TGETB" and field(object.value, c) or nil }
    end
  elseif name == "TSETS" then
    local object, key = regs[b], string_constant(f, c)
    if object == point then
      found.writes[key] = found.writes[key] or line()
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
    elseif object and object.kind == "shared" then
      store("assigns into a table that all points share")
    end
  elseif name == "USETV" or name == "USETS" or name == "USETN" or name == "USETP" then
    if upvalue_of(f, a, outer) then store(("assigns the upvalue %q"):format(util.funcuvname(f, a))) end
  elseif name == "GSET" then
    store(("assigns the global %q"):format(string_constant(f, d)))
  elseif name == "FNEW" then
    local child = util.funck(f, -d - 1)
    if child then analyse_function(child, found, false, upvalues_by_name(f, outer)) end
  elseif name == "CALL" or name == "CALLM" or name == "CALLT" or name == "CALLMT" then
    local callee, first = regs[a], a + 2 -- two slots a frame
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
    elseif callee and callee.kind == "shared" and type(callee.value) == "function" then
      analyse_function(callee.value, found, false)
      local target = regs[first]
      if writers[callee.value] and target and target.kind == "shared" then
        store(("changes a table that all points share by %s"):format(writers[callee.value]))
      end
    end
    for slot = a, a + 250 do regs[slot] = nil end
  end

  -- A shared function that is passed on, or kept in a local, may be called by whoever gets it.
  if result and result.kind == "shared" and type(result.value) == "function" then
    analyse_function(result.value, found, false)
  end

  if writes_a then
    regs[a] = result
  elseif name == "KNIL" then
    for slot = a, d do regs[slot] = nil end
  elseif name == "VARG" or name == "ITERC" or name == "ITERN" or name == "TNEW" then
    for slot = a, a + 250 do regs[slot] = nil end
  elseif name == "FORI" or name == "FORL" or name == "IFORL" then
    regs[a + 3] = nil
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

-- f: a function, or the prototype of one that a kernel makes; outer: of a prototype, what finds the upvalues of the
-- functions around it by name. The kernel's first parameter is the point; of helpers nothing is known.
function analyse_function(f, found, is_kernel, outer)
  if found.seen[f] then return end
  found.seen[f] = true
  local info = util.funcinfo(f)
  if not info.bytecodes then return end -- native
  if info.source:sub(1, 7) == "=[rapid" then return end -- ours

  local entry = {}
  if is_kernel and info.params > 0 then entry[0] = point end
  local states = { [1] = entry }
  local open = { 1 }
  while #open > 0 do
    local pc = table.remove(open)
    local regs = {}
    for slot, value in pairs(states[pc]) do regs[slot] = value end
    for _, next_pc in ipairs(step(f, pc, regs, found, outer)) do
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
end

-- env: the environment in which the kernel's globals live; of_a_point: its first parameter is one.
local function analyse(kernel, env, of_a_point)
  local found = {
    reads = {}, writes = {}, may = {}, may_write = {}, joins = {}, asks = {}, calls = {}, stores = {}, seen = {},
    env = env,
  }
  analyse_function(kernel, found, of_a_point)
  found.seen, found.env = nil, nil
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
