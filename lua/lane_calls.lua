-- Functions without bytecode that kernels call, in programs of lanes: the point's methods, Lua's own functions, vec3
-- and quat. Each takes the program, the state of the path and the arguments, and returns a list of results.
local ffi = require "ffi"
local lane = require "lane_program"
local vector = require "vec3"

jit.off(true, true)

local give_up, constant, nothing = lane.give_up, lane.constant, lane.nothing

-- Methods of the point.
local methods = {}

function methods.rand(program, _, args)
  local use, frame = args[2], args[3] or nothing
  if not use or use.kind ~= "number" then give_up "p:rand takes a number" end
  local number
  if frame.kind == "constant" and frame.value == nil then
    number = program:number(0).id
  else
    if frame.kind == "frame" then
      number = program:emit("chunk", nil, nil, nil, 0)
    elseif frame.kind == "step" then
      number = program:emit "LoadTime"
    elseif frame.kind == "number" then
      number = frame.id
    else
      give_up "p:rand takes the frame, or a number"
    end
    -- 0 stands for a number that is the same in every frame.
    local zero = program:number(0).id
    number = program:choose(program:emit("Equal", number, zero), program:number(5e-324).id, number)
  end
  return { { kind = "number", id = program:emit("Random", use.id, number) } }
end

function methods.within(program, state, args)
  local key = program:group_key(args[2] or nothing)
  return { key and (state.memory[key] or program:initial(key)) or constant(false) }
end

function methods.join(program, state, args)
  state.memory[program:group_key(args[2] or nothing, true)] = { kind = "flag", id = program.visited }
  return {}
end

function methods.leave(program, state, args)
  state.memory[program:group_key(args[2] or nothing, true)] = { kind = "flag", id = program:no_flag() }
  return {}
end

function methods.kill(program, state)
  if program.layout.predicate then give_up "a test kills" end
  state.memory.kill = { kind = "flag", id = program.visited }
  return {}
end

-- Lua's own functions, keyed by the function itself.
local natives = {}

local function numbers(args, count)
  for k = 1, count do
    if not args[k] or args[k].kind ~= "number" then give_up "a function of numbers is given something else" end
  end
end

local function operation(op)
  return function(program, _, args)
    numbers(args, 1)
    return { { kind = "number", id = program:emit(op, args[1].id) } }
  end
end

-- Returns a translation of a function of bindings/host/kernel_functions.h that takes one number or two.
local function of_host(name, count)
  return function(program, _, args)
    numbers(args, count)
    if #args > count then give_up("math." .. name .. " takes more") end
    local list = program["functions" .. count]
    local place
    for k, known in ipairs(list) do place = known == name and k or place end
    if not place then
      list[#list + 1] = name
      place = #list
    end
    return { { kind = "number",
               id = program:emit("Call" .. count, args[1].id, count == 2 and args[2].id or nil, nil, place - 1) } }
  end
end

local function extreme(op)
  return function(program, _, args)
    numbers(args, math.max(#args, 1))
    local id = args[1].id
    for k = 2, math.max(#args, 2) do id = program:emit(op, id, (args[k] or args[1]).id) end
    return { { kind = "number", id = id } }
  end
end

natives[math.sqrt], natives[math.abs] = operation "SquareRoot", operation "Absolute"
natives[math.floor], natives[math.ceil] = operation "Floor", operation "Ceiling"
natives[math.sin], natives[math.cos], natives[math.exp] = operation "Sine", operation "Cosine", operation "Exponential"
natives[math.min], natives[math.max] = extreme "Least", extreme "Most"
for _, name in ipairs { "tan", "asin", "acos", "atan", "log10", "sinh", "cosh", "tanh" } do
  natives[math[name]] = of_host(name, 1)
end
natives[math.atan2], natives[math.ldexp] = of_host("atan2", 2), of_host("ldexp", 2)

local natural, with_base = operation "Logarithm", of_host("log", 2)
natives[math.log] = function(program, state, args)
  return (#args > 1 and with_base or natural)(program, state, args)
end

-- Also the operator ^. A square is a product.
natives[math.pow] = function(program, _, args)
  numbers(args, 2)
  local x, y = args[1], args[2]
  if lane.constant_of(program, y) == 2 then
    return { { kind = "number", id = program:emit("Multiply", x.id, x.id) } }
  end
  return { { kind = "number", id = program:emit("Power", x.id, y.id) } }
end
local type_names = { number = "number", vector = "cdata", flag = "boolean", point = "cdata", frame = "cdata",
                     step = "cdata", params = "userdata", detail = "userdata", method = "function" }

natives[type] = function(_, _, args)
  local value = args[1]
  if not value or value.kind == "poison" then give_up "type of nothing" end
  return { constant(value.kind == "constant" and type(value.value) or type_names[value.kind]) }
end

natives[ffi.istype] = function(_, _, args)
  local of, value = args[1], args[2]
  if not value or value.kind == "poison" then give_up "a value has two types" end
  if value.kind == "constant" and type(value.value) == "cdata" or value.kind == "frame" or value.kind == "step" then
    give_up "a type is asked for"
  end
  return { constant(value.kind == "vector" and rawequal(value.of, of.value)) }
end

natives[tonumber] = function(_, _, args)
  numbers(args, 1)
  if args[2] then give_up "tonumber has a base" end
  return { args[1] }
end

local function construct(of, args)
  local size = rawequal(of, vector.type) and 3 or 4
  numbers(args, size)
  local result = { kind = "vector", of = of, size = size }
  for k = 1, size do result[k] = args[k].id end
  return { result }
end

natives[vector.type] = function(_, _, args) return construct(vector.type, args) end
natives[vector.quat] = function(_, _, args) return construct(vector.quat, args) end

return { methods = methods, natives = natives }
