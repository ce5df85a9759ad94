-- Translates kernels into programs for many points at once (runtime/lanes/lane_program.h), by following a kernel's
-- bytecode with unknown values.
--
-- Every register holds a description of its value: numbers and vectors are nodes of the program, and values that all
-- points share are known. Calls are followed into the function's own bytecode, including that of vec3.lua, so that each
-- operation has one definition. If a condition differs from point to point, both sides are followed, each under a mask,
-- and joined where they meet. If the program cannot express something (a loop, a table, a string, an error), the kernel
-- goes to the trace compiler; under a mask only the tiles in which a point gets there do.
local bit = require "bit"
local calls = require "lane_calls"
local lane = require "lane_program"
local util = require "jit.util"
local vector = require "vec3"
local vmdef = require "jit.vmdef"

local band, rshift = bit.band, bit.rshift
local Program, give_up, constant, nothing = lane.Program, lane.give_up, lane.constant, lane.nothing
local constant_of, truth_of, as_value, is_flag = lane.constant_of, lane.truth_of, lane.as_value, lane.is_flag
local component_names = lane.component_names

jit.off(true, true) -- the translation runs once per kernel, and the code per chunk is short

local names = {}
for op = 0, #vmdef.bcnames / 6 - 1 do
  names[op] = vmdef.bcnames:sub(op * 6 + 1, op * 6 + 6):gsub("%s", "")
end

local max_steps, max_depth = 20000, 30

local run -- follows a function; defined below

-- Returns the results of a call and the state after it; the state is nil if every path ends.
function Program:call(state, callee, args, depth)
  if callee.kind == "method" then
    if not (args[1] and args[1].kind == "point") then give_up "a method is called without its point" end
    return calls.methods[callee.name](self, state, args), state
  end
  local f = callee.kind == "constant" and callee.value
  local native = calls.natives[f]
  if native then return native(self, state, args), state end
  if type(f) ~= "function" then give_up "it calls a value" end
  if not util.funcinfo(f).bytecodes then give_up "it calls a function of Lua's library" end
  return run(self, f, args, state, depth + 1)
end

-- Returns one result of a function of vec3.lua.
function Program:of_vectors(state, name, a, b, depth)
  local with = a.kind == "vector" and a or b
  if with.kind ~= "vector" then give_up "an operator is given something else" end
  local f = vector.operators(with.of)[name]
  if not f then give_up("vectors have no " .. name) end
  local results, after = self:call(state, constant(f), { a, b }, depth)
  return results and results[1] or nothing, after
end

local chunk_fields = { number = 0, time = 1, dt = 2 }

function Program:attribute(state, name)
  local place = self:place_of(name)
  if place then return self:load(state, place) end
  if name == "nage" then
    local age, life = self:place_of "age", self:place_of "life"
    if age and life then
      return { kind = "number", id = self:emit("Divide", self:load(state, age).id, self:load(state, life).id) }
    end
  end
  if name == "dt" then return { kind = "number", id = self:emit("chunk", nil, nil, nil, 2) } end
  if name == "index" then return { kind = "number", id = self:emit "Index" } end
  if calls.methods[name] then return { kind = "method", name = name } end
  give_up("no attribute " .. name)
end

-- Returns object.name, and the state after it, since vectors look their fields up in functions.
function Program:field(state, object, name, depth)
  local kind = object.kind
  if kind == "point" then return self:attribute(state, name), state end
  if kind == "vector" then
    for k = 1, object.size do
      if component_names[k] == name then return { kind = "number", id = object[k] }, state end
    end
    return self:of_vectors(state, "__index", object, constant(name), depth)
  end
  if (kind == "frame" or kind == "step") and name == "detail" then return { kind = "detail" }, state end
  if kind == "frame" and chunk_fields[name] then
    return { kind = "number", id = self:emit("chunk", nil, nil, nil, chunk_fields[name]) }, state
  end
  if kind == "step" then
    if name == "time" then return { kind = "number", id = self:emit "LoadTime" }, state end
    if name == "dt" then return { kind = "number", id = self:emit "LoadStep" }, state end
    if name == "index" then return { kind = "number", id = self:emit("chunk", nil, nil, nil, 3) }, state end
  end
  local holder = self.holder
  local get
  if kind == "params" then
    get = function() return rawget(holder.values, name) end
  elseif kind == "detail" then
    get = function() return rawget(holder.details, name) end
  elseif kind == "constant" and type(object.value) == "table" then
    local map = object.value
    if rawget(map, name) == nil and debug.getmetatable(map) then give_up "a table has a metatable" end
    return self:shared(rawget(map, name), function() return rawget(map, name) end, object.is_own), state
  else
    give_up(("it indexes a %s"):format(kind))
  end
  local value = get()
  if value == nil then give_up("there is no " .. tostring(name)) end
  return self:shared(value, get), state
end

local arithmetic = { ADD = "Add", SUB = "Subtract", MUL = "Multiply", DIV = "Divide", MOD = "Modulo" }
local operators = { ADD = "__add", SUB = "__sub", MUL = "__mul", DIV = "__div", MOD = "__mod" }
local computed = {
  ADD = function(a, b) return a + b end,
  SUB = function(a, b) return a - b end,
  MUL = function(a, b) return a * b end,
  DIV = function(a, b) return a / b end,
  MOD = function(a, b) return a % b end,
}

function Program:compute(state, op, a, b, depth)
  if a.kind == "number" and b.kind == "number" then
    local x, y = constant_of(self, a), constant_of(self, b)
    if x and y then
      local value = computed[op](x, y)
      if value == value then return self:number(value), state end
    end
    return { kind = "number", id = self:emit(arithmetic[op], a.id, b.id) }, state
  end
  return self:of_vectors(state, operators[op], a, b, depth)
end

function Program:compare(op, a, b)
  if a.kind ~= "number" or b.kind ~= "number" then give_up "it compares values that are not numbers" end
  local x, y = constant_of(self, a), constant_of(self, b)
  if x and y then
    if op == "Less" then return x < y elseif op == "LessOrEqual" then return x <= y else return x == y end
  end
  return self:emit(op, a.id, b.id)
end

function Program:equal(state, a, b, depth)
  if a.kind == "poison" or b.kind == "poison" then give_up "a value has two types" end
  if a.kind == "number" and b.kind == "number" then return self:compare("Equal", a, b), state end
  if a.kind == "vector" and b.kind == "vector" then
    local value, after = self:of_vectors(state, "__eq", a, b, depth)
    return after and truth_of(value), after
  end
  if is_flag(a) and is_flag(b) then
    if a.kind == "constant" and b.kind == "constant" then return a.value == b.value, state end
    if a.kind == "constant" then a, b = b, a end
    if b.kind ~= "constant" then give_up "it compares flags" end
    return b.value and a.id or self:inverse(a.id), state
  end
  if a.kind == "constant" and b.kind == "constant" then
    if type(a.value) == "cdata" or type(b.value) == "cdata" or type(a.value) == "table" then
      give_up "it compares objects"
    end
    return rawequal(a.value, b.value), state
  end
  local plain = { number = true, flag = true, constant = true }
  if not ((plain[a.kind] or a.kind == "vector") and (plain[b.kind] or b.kind == "vector")) then
    give_up "it compares objects"
  end
  if a.kind == "constant" and type(a.value) == "cdata" or b.kind == "constant" and type(b.value) == "cdata" then
    give_up "it compares objects"
  end
  return false, state
end

-- The effect of each instruction on a path. `at` has f, the operands, program, state, args and depth; the value of its
-- first operand's register is returned.
local effects = {}

local function reg(at, slot)
  return at.state.regs[slot] or give_up "a register has no value"
end

local function text_constant(at, index)
  local value = util.funck(at.f, -index - 1)
  return type(value) == "string" and value or give_up "a key is no text"
end

local function number_constant(at, index)
  return at.program:number(util.funck(at.f, index))
end

function effects.MOV(at) return reg(at, at.d) end
function effects.NOT(at) return as_value(at.program:inverse(truth_of(reg(at, at.d)))) end
function effects.UNM(at)
  local value = reg(at, at.d)
  if value.kind == "number" then
    local x = constant_of(at.program, value)
    if x then return at.program:number(-x) end
    return { kind = "number", id = at.program:emit("Negate", value.id) }
  end
  local result
  result, at.state = at.program:of_vectors(at.state, "__unm", value, value, at.depth)
  return result
end
function effects.KSTR(at) return constant(util.funck(at.f, -at.d - 1)) end
function effects.KSHORT(at) return at.program:number(at.d < 0x8000 and at.d or at.d - 0x10000) end
function effects.KNUM(at) return number_constant(at, at.d) end

local primitives = { [0] = nothing, constant(false), constant(true) }
function effects.KPRI(at) return primitives[at.d] end

for op in pairs(arithmetic) do
  local function with(a_of, b_of)
    return function(at)
      local result
      result, at.state = at.program:compute(at.state, op, a_of(at), b_of(at), at.depth)
      return result
    end
  end
  local function of_b(at) return reg(at, at.b) end
  local function of_c(at) return reg(at, at.c) end
  local function constant_c(at) return number_constant(at, at.c) end
  effects[op .. "VN"] = with(of_b, constant_c)
  effects[op .. "NV"] = with(constant_c, of_b)
  effects[op .. "VV"] = with(of_b, of_c)
end

function effects.UGET(at)
  local f, place = at.f, at.d + 1
  local _, value = debug.getupvalue(f, place)
  return at.program:shared(value, function()
    local _, now = debug.getupvalue(f, place)
    return now
  end, at.is_own)
end

function effects.GGET(at)
  local env, name = getfenv(at.f), text_constant(at, at.d)
  if debug.getmetatable(env) then give_up "globals have a metatable" end
  return at.program:shared(rawget(env, name), function() return rawget(env, name) end, at.is_own)
end

function effects.TGETS(at)
  local value
  value, at.state = at.program:field(at.state, reg(at, at.b), text_constant(at, at.c), at.depth)
  return value
end

function effects.TGETB(at)
  local object = reg(at, at.b)
  if object.kind ~= "constant" then give_up "it indexes by a number" end
  local value
  value, at.state = at.program:field(at.state, object, at.c, at.depth)
  return value
end

function effects.TGETV(at)
  local key = reg(at, at.c)
  local name = key.kind == "constant" and key.value or constant_of(at.program, key)
  if type(name) ~= "string" and type(name) ~= "number" then give_up "a key is computed" end
  local object = reg(at, at.b)
  if type(name) == "number" and object.kind ~= "constant" then give_up "it indexes by a number" end
  local value
  value, at.state = at.program:field(at.state, object, name, at.depth)
  return value
end

local statements = {} -- instructions that write no register, or several

function statements.TSETS(at)
  if reg(at, at.b).kind ~= "point" then give_up "it writes into a table" end
  at.program:store(at.state, text_constant(at, at.c), reg(at, at.a))
end

function statements.TSETV(at)
  local key = reg(at, at.c)
  if reg(at, at.b).kind ~= "point" or key.kind ~= "constant" or type(key.value) ~= "string" then
    give_up "it writes into a table"
  end
  at.program:store(at.state, key.value, reg(at, at.a))
end

function statements.KNIL(at)
  for slot = at.a, at.d do at.state.regs[slot] = nothing end
end

-- Puts `values` into registers from `first` on: `count` of them, or all, as results of a call with any number.
local function spread(at, first, values, count)
  if count < 0 then
    at.state.results = { first = first, values = values }
    return
  end
  for k = 1, count do at.state.regs[first + k - 1] = values[k] or nothing end
end

-- Returns the values of `count` registers from `first` on, followed by those of the last call with any number of
-- results.
local function gather(at, first, count, with_results)
  local list = {}
  for k = 1, count do list[k] = reg(at, first + k - 1) end
  if with_results then
    local results = at.state.results or give_up "results of a call are missing"
    for _, value in ipairs(results.values) do list[#list + 1] = value end
  end
  return list
end

local function call(at, count, with_results)
  local results
  results, at.state = at.program:call(at.state, reg(at, at.a), gather(at, at.a + 2, count, with_results), at.depth)
  return results
end

function statements.CALL(at)
  local results = call(at, at.c - 1)
  if at.state then spread(at, at.a, results, at.b - 1) end
end
function statements.CALLM(at)
  local results = call(at, at.c, true)
  if at.state then spread(at, at.a, results, at.b - 1) end
end
function statements.VARG(at)
  local values = {}
  for k = at.info.params + 1, #at.args do values[#values + 1] = at.args[k] end
  spread(at, at.a, values, at.b - 1)
end

local returns = {
  RET = function(at) return gather(at, at.a, at.d - 1) end,
  RETM = function(at) return gather(at, at.a, at.d, true) end,
  RET0 = function() return {} end,
  RET1 = function(at) return { reg(at, at.a) } end,
  CALLT = function(at) return call(at, at.d - 1) end,
  CALLMT = function(at) return call(at, at.d, true) end,
}

-- Conditions: each returns the flag under which the jump after the instruction is taken.
local conditions = {}
function conditions.ISLT(at) return at.program:compare("Less", reg(at, at.a), reg(at, at.d)) end
function conditions.ISGE(at) return at.program:inverse(conditions.ISLT(at)) end
function conditions.ISLE(at) return at.program:compare("LessOrEqual", reg(at, at.a), reg(at, at.d)) end
function conditions.ISGT(at) return at.program:inverse(conditions.ISLE(at)) end

for suffix, operand in pairs {
  V = function(at) return reg(at, at.d) end,
  S = function(at) return constant(util.funck(at.f, -at.d - 1)) end,
  N = function(at) return number_constant(at, at.d) end,
  P = function(at) return primitives[at.d] end,
} do
  conditions["ISEQ" .. suffix] = function(at)
    local flag
    flag, at.state = at.program:equal(at.state, reg(at, at.a), operand(at), at.depth)
    return flag
  end
  conditions["ISNE" .. suffix] = function(at)
    local flag = conditions["ISEQ" .. suffix](at)
    return at.state and at.program:inverse(flag)
  end
end
function conditions.IST(at) return truth_of(reg(at, at.d)) end
function conditions.ISF(at) return at.program:inverse(truth_of(reg(at, at.d))) end
-- These also copy the value if the jump is taken.
conditions.ISTC, conditions.ISFC = conditions.IST, conditions.ISF

-- Instructions that no program can express, with the reason.
local beyond = {
  TNEW = "it makes a table", TDUP = "it makes a table", FNEW = "it makes a function", CAT = "it joins texts",
  LEN = "it takes a length", LOOP = "it has a loop", ITERC = "it has a loop", ITERN = "it has a loop",
  USETV = "it assigns an upvalue", UCLO = "it makes a function",
}

-- Runs one instruction of a path. Returns "return" and values; "jump" and its target; "branch", a flag and its target;
-- or nothing.
local function step(at)
  local name = at.name
  if returns[name] then return "return", returns[name](at) end
  if name == "JMP" then return "jump", at.pc + at.d - 0x7fff end
  if conditions[name] then
    local flag = conditions[name](at)
    local jump = util.funcbc(at.f, at.pc + 1)
    return "branch", flag, at.pc + 1 + rshift(jump, 16) - 0x7fff
  end
  if statements[name] then return nil, statements[name](at) end
  if not effects[name] then give_up(beyond[name] or "it has the instruction " .. name) end
  local value = effects[name](at)
  if at.state then at.state.regs[at.a] = value end
end

-- A function that is followed: the path that reaches the next instruction, nil if all have gone elsewhere; the paths
-- that arrive at a position by a jump; and those that have returned.
local Activation = {}
Activation.__index = Activation

function Activation:send(place, from, path)
  if place <= from then give_up "it has a loop" end
  self.pending[place] = self.pending[place] or {}
  table.insert(self.pending[place], path)
end

-- Joins the paths that arrive at a position. The last one sent is the innermost, so that masks return to those of their
-- parents.
function Activation:arrive(pc)
  local paths = self.pending[pc] or {}
  self.pending[pc] = nil
  for k = #paths, 1, -1 do self.path = self.program:join(self.path, paths[k]) end
end

-- Continues the path where the flag of a condition leads it, skipping the jump instruction itself.
function Activation:branch(at, flag, target)
  local path = at.state
  self.path = nil
  local function taken(state)
    if at.name == "ISTC" or at.name == "ISFC" then state.regs[at.a] = state.regs[at.d] end
    self:send(target, at.pc, state)
  end
  if flag == true then
    taken(path)
  elseif flag == false then
    self:send(at.pc + 2, at.pc, path)
  else
    local with, without = self.program:split(path, flag)
    taken(with)
    self:send(at.pc + 2, at.pc, without)
  end
end

-- Unrolls a loop over known numbers. Returns the position after it.
function Activation:unroll(at)
  local program, behind = self.program, at.pc + at.d - 0x7fff
  local value, last, by = constant_of(program, reg(at, at.a)), constant_of(program, reg(at, at.a + 1)),
    constant_of(program, reg(at, at.a + 2))
  if not (value and last and by) or by == 0 then give_up "it has a loop whose steps are not known" end
  while self.path and (by > 0 and value <= last or by < 0 and value >= last) do
    self.path.regs[at.a + 3] = program:number(value)
    self:follow(at.pc + 1, behind - 1)
    value = value + by
  end
  return behind
end

local is_loop = { FORI = true, JFORI = true }
local loop_end = { FORL = true, IFORL = true, JFORL = true }

-- Runs the instruction at pc. Returns the position of the next one.
function Activation:advance(pc)
  local program, path = self.program, self.path
  program.steps = program.steps + 1
  if program.steps > max_steps then give_up "it is long" end
  local ins = util.funcbc(self.f, pc)
  local at = setmetatable({
    pc = pc, state = path, name = names[band(ins, 0xff)], a = band(rshift(ins, 8), 0xff), b = rshift(ins, 24),
    c = band(rshift(ins, 16), 0xff), d = rshift(ins, 16),
  }, { __index = self })
  if loop_end[at.name] then return pc + 1 end
  local mask = path.mask
  local done, what, value, target = pcall(function()
    if is_loop[at.name] then return "loop", self:unroll(at) end
    return step(at)
  end)
  if not done then
    -- Under a mask the failure depends on the points that get here.
    if type(what) ~= "table" or mask == program.visited then error(what, 0) end
    program:emit("Fail", mask)
    program.failure = program.failure or what.reason
    self.path = nil
  elseif what == "loop" then
    return value
  elseif not at.state then
    self.path = nil
  elseif what == "return" then
    table.insert(self.ends, { values = value, state = at.state })
    self.path = nil
  elseif what == "jump" then
    self.path = nil
    self:send(value, pc, at.state)
  elseif what == "branch" then
    self:branch(at, value, target)
  else
    self.path = at.state
  end
  return pc + 1
end

function Activation:follow(first, last)
  local pc = first
  while pc <= last do
    self:arrive(pc)
    pc = self.path and self:advance(pc) or pc + 1
  end
end

-- Joins the paths that have returned: their results, memory and mask.
function Activation:joined_ends()
  local results, after
  for k = #self.ends, 1, -1 do
    local values, path = self.ends[k].values, self.ends[k].state
    local behind = { regs = {}, memory = path.memory, mask = path.mask }
    if not after then
      results, after = values, behind
    else
      local joined = {}
      for place = 1, math.max(#results, #values) do
        joined[place] = self.program:choose_value(behind.mask, values[place] or nothing, results[place] or nothing)
      end
      results, after = joined, self.program:join(after, behind)
    end
  end
  return results, after
end

-- Follows f, called with these values by the points of a state. Returns its results and the state after it, or nothing
-- if no path returns.
function run(program, f, args, state, depth)
  if depth > max_depth then give_up "its calls are nested" end
  local info = util.funcinfo(f)
  local path = { regs = {}, memory = state.memory, mask = state.mask }
  for slot = 0, info.params - 1 do path.regs[slot] = args[slot + 1] or nothing end
  local activation = setmetatable({
    program = program, f = f, info = info, is_own = info.source:find("^=%[rapid") ~= nil, args = args, depth = depth,
    path = path, pending = {}, ends = {},
  }, Activation)
  activation:follow(1, info.bytecodes - 1)
  local results, after = activation:joined_ends()
  if not after then return nil end
  return results, { regs = state.regs, memory = after.memory, mask = after.mask, results = state.results }
end
-- Returns the instructions that store a state's memory: columns, then groups, then deaths.
local function stores_of_memory(program, state)
  local layout, memory, list = program.layout, state.memory, {}
  for place, column in ipairs(layout.columns) do
    local value, op = memory[place], lane.stores[column.type]
    -- The store itself converts the number.
    local function stored(id)
      local node = program.nodes[id]
      return node.op == lane.conversions[column.type] and node.a or id
    end
    if value and value.kind == "vector" and value.size == 3 then
      list[#list + 1] = { op = op, nodes = { stored(value[1]), stored(value[2]), stored(value[3]) },
                          number = place - 1 }
    elseif value then
      for k = 1, value.size or 1 do
        list[#list + 1] = { op = op, nodes = { stored(value.id or value[k]) }, component = k - 1, number = place - 1 }
      end
    end
  end
  for place in ipairs(layout.groups) do
    local value = memory["g" .. place]
    if value then list[#list + 1] = { op = "StoreFlag", nodes = { program:flag_node(value) }, number = place - 1 } end
  end
  if memory.kill then list[#list + 1] = { op = "Kill", nodes = { program:flag_node(memory.kill) } } end
  return list
end

-- Returns the program of a kernel for a layout (lua/kernel.lua), or nil and the reason. holder: its `values` and
-- `details` are the node's parameters and the detail values of the pass. program.inputs_now() returns true and the
-- inputs, or false if a value that all points share has changed its kind.
local function translate(kernel, layout, holder)
  local program = lane.new(layout, holder)
  local done, result = pcall(function()
    local params = next(holder.values) ~= nil and { kind = "params" } or nil
    local args = { { kind = "point" }, { kind = layout.action and "step" or "frame" }, params }
    local results, state = run(program, kernel, args, { regs = {}, memory = {}, mask = program.visited }, 1)
    if not state then give_up(program.failure) end
    local stores_of = stores_of_memory(program, state)
    if layout.predicate then
      stores_of[#stores_of + 1] = { op = "StoreResult", nodes = { program:flag_node(results[1] or nothing) } }
    end
    return program:assemble(stores_of)
  end)
  if not done then
    if type(result) ~= "table" then error(result, 0) end
    return nil, result.reason
  end
  local getters, guards = program.getters, program.guards
  function result.inputs_now()
    for _, guard in ipairs(guards) do
      if not rawequal(guard.get(), guard.value) then return false end
    end
    local now = {}
    for place, get in ipairs(getters) do
      local value = get()
      if type(value) ~= "number" then return false end
      now[place] = value
    end
    return true, unpack(now, 1, #getters)
  end
  return result
end

return { translate = translate }
