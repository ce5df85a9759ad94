-- Builds a program of lanes (runtime/lanes/lane_program.h): its operations as nodes, the values in registers, the paths
-- that points take, columns and groups, and finally slots for the nodes.
local ffi = require "ffi"
local vector = require "vec3"

jit.off(true, true) -- runs once per kernel

local max_nodes = 4000

-- Gives up: the kernel, or the rest of this path, cannot be a program. The reason is reported on request.
local function give_up(reason)
  error({ reason = reason }, 0)
end

local function constant(value)
  return { kind = "constant", value = value }
end
local nothing = constant(nil)
local poison = { kind = "poison" } -- differs between two paths in a register that is not read again

local component_names = { "x", "y", "z", "w" }

-- The program of a kernel.
local Program = {}
Program.__index = Program

local function new_program(layout, holder)
  local program = setmetatable({ nodes = {}, known = {}, splits = {}, getters = {}, guards = {}, layout = layout,
                                 holder = holder, functions1 = {}, functions2 = {}, steps = 0 }, Program)
  program.visited = program:emit("visited")
  return program
end

-- Classes of nodes by how their values vary: constant within a chunk; mostly constant from tile to tile, because they
-- come from the column `dt`, in which only newborn points differ; different from point to point.
local shared, steady, varying = 0, 1, 2

local reads_lane = { visited = true, Random = true, LoadTime = true, LoadStep = true, Index = true, LoadFlag = true }

-- Operations with three operands. A fused pair of operations uses the result of the first in the second; in a
-- difference it is the left operand or, if the name has From, the right one.
local takes_three = { Choose = true }
local of_two = { Add = true, Subtract = true, Multiply = true }
for first in pairs(of_two) do
  for _, second in ipairs { "Add", "Subtract", "SubtractFrom", "Multiply" } do takes_three[first .. second] = true end
end

-- Returns the operands of a node that are nodes.
local function operands(node)
  return { node.a, node.b, takes_three[node.op] and node.c or nil }
end

-- Returns the node of an operation; equal operations share one. number: of a column, a group, a function or a constant.
-- varies: how much it varies in addition to its operands.
function Program:emit(op, a, b, c, number, varies)
  local key = ("%s %s %s %s %s"):format(op, a or "", b or "", c or "", number and ("%.17g"):format(number) or "")
  local id = self.known[key]
  if id then return id end
  local nodes = self.nodes
  if #nodes >= max_nodes then give_up "it is long" end
  local node = { op = op, a = a, b = b, c = c, number = number }
  node.varies = varies or reads_lane[op] and varying or shared
  for _, operand in ipairs(operands(node)) do node.varies = math.max(node.varies, nodes[operand].varies) end
  id = #nodes + 1
  nodes[id] = node
  self.known[key] = id
  return id
end

function Program:number(value)
  if value ~= value then give_up "a constant is no number" end
  return { kind = "number", id = self:emit("constant", nil, nil, nil, value) }
end

local function constant_of(program, value)
  local node = value.kind == "number" and program.nodes[value.id]
  return node and node.op == "constant" and node.number or nil
end

-- Returns true for a vec3. ffi.istype() alone also accepts the type itself.
local function is_vec3(value)
  return type(value) == "cdata" and ffi.istype(vector.type, value) and not rawequal(value, vector.type)
end

-- Adds a number that all points share. `get` reads it again for each chunk.
function Program:input(get)
  self.getters[#self.getters + 1] = get
  return { kind = "number", id = self:emit("input", nil, nil, nil, #self.getters) }
end

-- Adds a value that all points share: `get` finds it again. Rapid's own values never change.
function Program:shared(value, get, is_own)
  if type(value) == "number" then
    if is_own then return self:number(value) end
    return self:input(get)
  end
  if is_vec3(value) then
    local result = { kind = "vector", of = vector.type, size = 3 }
    for k = 1, 3 do
      local name = component_names[k]
      result[k] = self:input(function()
        local now = get()
        return is_vec3(now) and now[name] or nil
      end).id
    end
    return result
  end
  if not is_own then self.guards[#self.guards + 1] = { get = get, value = value } end
  return constant(value)
end

-- A flag is true, false, or a node.

function Program:no_flag()
  return self:emit("AndNot", self.visited, self.visited)
end

local function truth_of(value)
  if value.kind == "flag" then return value.id end
  if value.kind == "constant" then return not not value.value end
  if value.kind == "poison" then give_up "a value has two types" end
  return true
end

function Program:flag_node(value)
  local truth = truth_of(value)
  if truth == true then return self.visited end
  if truth == false then return self:no_flag() end
  return truth
end

function Program:inverse(flag)
  if type(flag) == "boolean" then return not flag end
  return self:emit("AndNot", self.visited, flag)
end

local function as_value(flag)
  return type(flag) == "boolean" and constant(flag) or { kind = "flag", id = flag }
end

-- The state of a path: registers, memory (columns, groups, kill), and the mask of the points that reach it.

local function copy(map)
  local result = {}
  for key, value in pairs(map) do result[key] = value end
  return result
end

local function copy_state(state)
  return { regs = copy(state.regs), memory = copy(state.memory), mask = state.mask, results = state.results }
end

-- Returns the states of the points with a flag, and of the points without it.
function Program:split(state, flag)
  local with, without = copy_state(state), copy_state(state)
  with.mask = self:emit("And", state.mask, flag)
  without.mask = self:emit("AndNot", state.mask, flag)
  self.splits[with.mask] = { parent = state.mask, other = without.mask }
  self.splits[without.mask] = { parent = state.mask, other = with.mask }
  return with, without
end

function Program:joined_mask(a, b)
  local split = self.splits[a]
  if split and split.other == b then return split.parent end
  return self:emit("Or", a, b)
end

function Program:choose(mask, a, b)
  if a == b then return a end
  return self:emit("Choose", mask, a, b)
end

local function is_flag(value)
  return value.kind == "flag" or value.kind == "constant" and type(value.value) == "boolean"
end

-- Kinds whose values are all equal; methods are equal if they have the same name.
local has_one_value = { point = true, frame = true, step = true, params = true, detail = true, method = true }

-- Returns a where the mask is set, else b. Values that no node can choose between are poison.
function Program:choose_value(mask, a, b)
  if a == b then return a end
  if a.kind == "constant" and b.kind == "constant" and rawequal(a.value, b.value) then return a end
  if a.kind == "number" and b.kind == "number" then
    return { kind = "number", id = self:choose(mask, a.id, b.id) }
  elseif a.kind == "vector" and b.kind == "vector" and a.of == b.of then
    local result = { kind = "vector", of = a.of, size = a.size }
    for k = 1, a.size do result[k] = self:choose(mask, a[k], b[k]) end
    return result
  elseif is_flag(a) and is_flag(b) then
    return { kind = "flag", id = self:choose(mask, self:flag_node(a), self:flag_node(b)) }
  elseif a.kind == b.kind and has_one_value[a.kind] and a.name == b.name then
    return a
  end
  return poison
end

function Program:join(a, b)
  if not a then return b end
  if not b then return a end
  local joined = { regs = {}, memory = {}, mask = self:joined_mask(a.mask, b.mask) }
  for slot, value in pairs(a.regs) do
    if b.regs[slot] then joined.regs[slot] = self:choose_value(b.mask, b.regs[slot], value) end
  end
  for _, memory in ipairs { a.memory, b.memory } do
    for key in pairs(memory) do
      joined.memory[key] = joined.memory[key]
        or self:choose_value(b.mask, b.memory[key] or self:initial(key), a.memory[key] or self:initial(key))
    end
  end
  return joined
end

-- Columns and groups. A key of memory is a column's index, a group's index as "g1", or "kill".

local loads = { float = "LoadFloat", vec3 = "LoadFloat", quat = "LoadFloat", vec3d = "LoadDouble", int32 = "LoadInt32",
                int64 = "LoadInt64" }
local stores = { float = "StoreFloat", vec3 = "StoreFloatVector", quat = "StoreFloat", vec3d = "StoreDoubleVector",
                 int32 = "StoreInt32", int64 = "StoreInt64" }
local sizes = { vec3 = 3, vec3d = 3, quat = 4 }
local checks = { int32 = "CheckInt32", int64 = "CheckInt64" }
-- Conversions of a number when it is stored in a column.
local conversions = { float = "Round", vec3 = "Round", quat = "Round", int32 = "Whole", int64 = "Whole" }

function Program:initial(key)
  if key == "kill" then return { kind = "flag", id = self:no_flag() } end
  if type(key) == "string" then
    local place = tonumber(key:sub(2))
    return { kind = "flag", id = self:emit("LoadFlag", nil, nil, nil, place - 1) }
  end
  local column = self.layout.columns[key]
  local load = loads[column.type]
  if not load then give_up("the attribute " .. column.name .. " is a text") end
  local varies = column.uniform and shared or column.name == "dt" and steady or varying
  local function component(k)
    return self:emit(load, nil, nil, k - 1, key - 1, varies)
  end
  local size = sizes[column.type]
  if not size then return { kind = "number", id = component(1) } end
  local result = { kind = "vector", of = size == 4 and vector.quat or vector.type, size = size }
  for k = 1, size do result[k] = component(k) end
  return result
end

function Program:place_of(name)
  for place, column in ipairs(self.layout.columns) do
    if column.name == name then return place end
  end
end

function Program:load(state, place)
  return state.memory[place] or self:initial(place)
end

function Program:store(state, name, value)
  local place = self:place_of(name)
  local column = place and self.layout.columns[place]
  if not (column and column.writable) then give_up("it writes " .. name) end
  local load, size = loads[column.type], sizes[column.type]
  if not load then give_up("the attribute " .. name .. " is a text") end
  if size and not (value.kind == "vector" and value.of == (size == 4 and vector.quat or vector.type))
      or not size and value.kind ~= "number" then
    give_up("it assigns another type to " .. name)
  end
  local check = checks[column.type] or "CheckFloat"
  local function kept(id)
    self:emit(check, state.mask, id)
    local conversion = conversions[column.type]
    return conversion and self:emit(conversion, id) or id
  end
  if not size then
    state.memory[place] = { kind = "number", id = kept(value.id) }
    return
  end
  local result = { kind = "vector", of = value.of, size = size }
  for k = 1, size do result[k] = kept(value[k]) end
  state.memory[place] = result
end

function Program:group_key(value, for_writing)
  if value.kind ~= "constant" or type(value.value) ~= "string" then give_up "a group is computed" end
  for place, group in ipairs(self.layout.groups) do
    if group.name == value.value and (group.writable or not for_writing) then return "g" .. place end
  end
  if for_writing then give_up "it joins a group that it does not name" end
end
local has_effect = { Fail = true, CheckFloat = true, CheckInt32 = true, CheckInt64 = true }
local is_given = { visited = true, chunk = true, constant = true, input = true }

-- Returns the set of nodes that the stores and the possible failures depend on. Operands precede their nodes.
function Program:needed(stores_of)
  local needed = {}
  for _, store in ipairs(stores_of) do
    for _, id in ipairs(store.nodes) do needed[id] = true end
  end
  for id = #self.nodes, 1, -1 do
    local node = self.nodes[id]
    needed[id] = needed[id] or has_effect[node.op]
    if needed[id] then
      for _, operand in ipairs(operands(node)) do needed[operand] = true end
    end
  end
  return needed
end

-- Fuses an operation with the only one that uses its result, which saves writing and reading it.
function Program:fuse(needed, stores_of)
  local nodes, uses = self.nodes, {}
  local function count(ids)
    for _, id in ipairs(ids) do uses[id] = (uses[id] or 0) + 1 end
  end
  for id, node in ipairs(nodes) do
    if needed[id] then count(operands(node)) end
  end
  for _, store in ipairs(stores_of) do count(store.nodes) end
  local function is_first(id)
    return uses[id] == 1 and nodes[id].varies == varying and of_two[nodes[id].op]
  end
  for id, node in ipairs(nodes) do
    if needed[id] and of_two[node.op] then
      local on_left = is_first(node.a)
      if on_left or is_first(node.b) then
        local place, other = node.a, node.b
        if not on_left then place, other = other, place end
        local first, second = nodes[place], not on_left and node.op == "Subtract" and "SubtractFrom" or node.op
        nodes[id] = { op = first.op .. second, a = first.a, b = first.b, c = other, varies = varying }
        needed[place] = nil
      end
    end
  end
end

-- Assigns the first slots to inputs and the next ones to constants. Returns the slots, the constants in order, and the
-- first free slot.
function Program:given_slots(needed)
  local slot_of, constants = { [self.visited] = 0 }, {}
  for id, node in ipairs(self.nodes) do
    if node.op == "chunk" then slot_of[id] = 1 + node.number end
    if node.op == "constant" and needed[id] then
      constants[#constants + 1] = node.number
      slot_of[id] = 4 + #constants
    end
  end
  for id, node in ipairs(self.nodes) do
    if node.op == "input" then slot_of[id] = 4 + #constants + node.number end
  end
  return slot_of, constants, 5 + #constants + #self.getters
end

local function instruction(nodes, slot_of, node)
  local c = node.c or 0
  if takes_three[node.op] then c = slot_of[node.c] end
  if node.op == "Random" then
    c = nodes[node.a].varies == shared and nodes[node.b].varies == shared and 1 or 0
  end
  return { op = node.op, slot_of[node] or 0, node.a and slot_of[node.a] or 0, node.b and slot_of[node.b] or 0, c,
           node.number or 0 }
end

-- Returns the program in the host's form: instructions are an operation's name and to, a, b, c and number. stores_of:
-- the instructions at its end, { op, nodes, component, number }, with one node, or the three of a vector.
function Program:assemble(stores_of)
  local nodes, needed = self.nodes, self:needed(stores_of)
  self:fuse(needed, stores_of)
  local slot_of, constants, next_slot = self:given_slots(needed)
  local result = { constants = constants, inputs = #self.getters, shared = {}, steady = {}, code = {}, kills = false,
                   steady_column = (self:place_of "dt" or 1) - 1, functions1 = self.functions1,
                   functions2 = self.functions2 }
  local function new_slot()
    next_slot = next_slot + 1
    return next_slot - 1
  end

  -- By position in the code: a slot is free again after the last instruction that reads it.
  local code, last = {}, {}
  for id, node in ipairs(nodes) do
    if needed[id] and not is_given[node.op] then
      if node.varies < varying and not has_effect[node.op] then
        slot_of[id] = new_slot()
        slot_of[node] = slot_of[id]
        table.insert(node.varies == shared and result.shared or result.steady, instruction(nodes, slot_of, node))
      else
        code[#code + 1] = id
        for _, operand in ipairs(operands(node)) do last[operand] = #code end
      end
    end
  end
  for _, store in ipairs(stores_of) do
    for _, id in ipairs(store.nodes) do last[id] = math.huge end
  end

  local free = {}
  for place, id in ipairs(code) do
    local node = nodes[id]
    if not has_effect[node.op] then
      slot_of[id] = table.remove(free) or new_slot()
      slot_of[node] = slot_of[id]
    end
    result.code[place] = instruction(nodes, slot_of, node)
    for _, operand in ipairs(operands(node)) do
      if last[operand] == place and nodes[operand].varies == varying and operand ~= self.visited then
        free[#free + 1] = slot_of[operand]
        last[operand] = nil -- both operands may be the same node
      end
    end
  end
  for _, store in ipairs(stores_of) do
    local a, b, c = store.nodes[1], store.nodes[2], store.nodes[3]
    result.code[#result.code + 1] = { op = store.op, 0, slot_of[a], b and slot_of[b] or 0,
                                      c and slot_of[c] or store.component or 0, store.number or 0 }
    result.kills = result.kills or store.op == "Kill"
  end
  result.slots = next_slot
  return result
end

return {
  new = new_program, Program = Program, give_up = give_up, constant = constant, nothing = nothing,
  constant_of = constant_of, truth_of = truth_of, as_value = as_value, is_flag = is_flag,
  component_names = component_names, conversions = conversions, stores = stores,
}
