-- The environment of graph code: ordinary Lua that cannot escape.
--
-- Out of reach are files, processes, ffi, debug, bytecode, other environments, addresses, and all sources of randomness
-- (the order of a string hash, math.random). Libraries are copies, so changes that graph code makes to them do not
-- reach Rapid's own.
local ffi = require "ffi"
local describe = require "describe"
local power_operator = require "power_operator"
local protected = require "protected"

local raw_tostring, raw_format, raw_pairs = tostring, string.format, pairs

local weak = "a table can't be weak (__mode), because its contents would depend on the garbage collector"

local function copy(library, without)
  local result = {}
  for name, value in raw_pairs(library) do result[name] = value end
  for _, name in ipairs(without or {}) do result[name] = nil end
  return result
end

-- Returns tostring(value) without addresses.
local function safe_tostring(value)
  local text = raw_tostring(value)
  if type(value) ~= "string" and type(text) == "string" and text:find "0x%x%x%x" then
    return (text:gsub(": 0x%x+", ""):gsub("0x%x+", "?"))
  end
  return text
end

-- Returns keys in an order that does not depend on the hash: numbers, then strings, then false, true. At most one other
-- key (a table, a function, a node) is allowed, since their order would be that of their addresses.
local function sorted_keys(map, what)
  local meta = debug.getmetatable(map)
  if meta and rawget(meta, "__mode") ~= nil then error(weak, 3) end
  local numbers, strings, others = {}, {}, {}
  for key in raw_pairs(map) do
    local kind = type(key)
    if kind == "number" then
      numbers[#numbers + 1] = key
    elseif kind == "string" then
      strings[#strings + 1] = key
    elseif kind ~= "boolean" then
      others[#others + 1] = key
    end
  end
  if #others > 1 then
    error(("%s can't order keys that are not numbers or strings (here: %s); use a list"):format(what,
      type(others[1])), 3)
  end
  table.sort(numbers)
  table.sort(strings)
  for _, key in ipairs(strings) do numbers[#numbers + 1] = key end
  for _, key in ipairs { false, true } do
    if rawget(map, key) ~= nil then numbers[#numbers + 1] = key end
  end
  numbers[#numbers + 1] = others[1]
  return numbers
end

local function sorted_pairs(map)
  if type(map) ~= "table" then error(("pairs needs a table, not %s"):format(describe.kind(map)), 2) end
  local keys, place = sorted_keys(map, "pairs"), 0
  return function()
    repeat
      place = place + 1
      if keys[place] == nil then return nil end
    until map[keys[place]] ~= nil
    return keys[place], map[keys[place]]
  end, map, nil
end

local function sorted_next(map, key)
  if type(map) ~= "table" then error(("next needs a table, not %s"):format(describe.kind(map)), 2) end
  local keys = sorted_keys(map, "next")
  if key == nil then return keys[1], map[keys[1]] end
  for place, known in ipairs(keys) do
    if known == key then
      local following = keys[place + 1]
      if following == nil then return nil end
      return following, map[following]
    end
  end
  error("next was given a key that is not in the table", 2)
end

local function safe_format(format, ...)
  if type(format) == "string" and format:gsub("%%%%", ""):find "%%[%d%.%-%+ #]*p" then
    error("%p is not available, because addresses differ from run to run", 2)
  end
  local count, values = select("#", ...), { ... }
  for place = 1, count do
    local kind = type(values[place])
    if kind ~= "string" and kind ~= "number" then values[place] = safe_tostring(values[place]) end
  end
  return raw_format(format, unpack(values, 1, count))
end
jit.off(safe_format) -- unpack is not compiled: its loop would be, in vain

-- Returns the remedy for a message of the compiler, or nil: a missing comma, bracket or colon.
local function remedy_for(message)
  local bracket, near = message:match "'([})])' expected.* near '([^']+)'$"
  if bracket then
    if near == "<eof>" then return ("a %s is missing before the end of the file"):format(bracket) end
    if near == ":" then return ("is a %s missing before the colon?"):format(bracket) end
    if bracket == ")" and near:find "^[=,]" then return "values and vectors have braces: { size = {4, 1, 4} }" end
    return near:find "^[%w_\"{]" and ("is a comma missing before %s?"):format(near)
  end
  if message:find("function arguments expected near", 1, true) then return "are braces {} missing after the name?" end
  near = message:match "'<eof>' expected near '([%a_][%w_]*)'$"
  return near and ("is a colon missing before %s?"):format(near)
end

local function with_remedy(message)
  local remedy = remedy_for(message)
  return remedy and ("%s; %s"):format(message, remedy) or message
end

-- native.read_module(name) returns the text and the chunk name of a module next to the graph, or nil and the searched
-- paths; native.outside_kernels(action, remedy) raises an error while a kernel runs. In a quiet environment (a
-- worker's) print does nothing: the first state has printed.
local function make(native, run)
  local env = {}
  local strings = copy(string, { "dump" })
  strings.format, strings.gsub = safe_format, protected.gsub

  -- The methods of strings are a copy that graph code cannot reach, since Rapid's own modules call them, too.
  local of_strings = debug.getmetatable("")
  of_strings.__index = copy(strings)
  of_strings.__metatable = false

  env._G = env
  env._VERSION = _VERSION
  env.assert, env.error, env.ipairs = assert, error, ipairs
  env.pcall, env.xpcall = protected.pcall, protected.xpcall
  env.select, env.tonumber, env.type, env.unpack = select, tonumber, type, unpack
  env.pairs, env.next, env.tostring = sorted_pairs, sorted_next, safe_tostring
  env.rawequal = rawequal
  env.string, env.bit = strings, copy(require "bit")
  env.math = copy(math, { "random", "randomseed" })
  env[power_operator.name] = math.pow
  env.table = copy(table, { "foreach", "foreachi", "getn" })
  env.table.sort = protected.sort
  env.coroutine = copy(coroutine)
  env.coroutine.resume, env.coroutine.wrap = protected.resume, protected.wrap

  function env.setmetatable(object, meta)
    if type(object) ~= "table" then error("setmetatable needs a table", 2) end
    if type(meta) == "table" and rawget(meta, "__mode") ~= nil then error(weak, 2) end
    return setmetatable(object, meta)
  end
  function env.getmetatable(object)
    if type(object) ~= "table" then return nil end
    return getmetatable(object)
  end
  function env.print(...)
    if native.is_quiet then return end
    local printed = {}
    for place = 1, select("#", ...) do printed[place] = safe_tostring((select(place, ...))) end
    native.print(table.concat(printed, "\t") .. "\n")
  end

  -- Text only: bytecode can do more than Lua.
  local function load_text(text, name)
    if type(text) ~= "string" then return nil, "load needs a string, not " .. describe.kind(text) end
    if text:byte(1) == 27 then return nil, "bytecode can't be loaded" end
    local chunk, message = loadstring(text, name)
    local with_calls = chunk and power_operator.rewrite(text)
    if with_calls then chunk, message = loadstring(with_calls, name) end
    if not chunk then return nil, with_remedy(message) end
    return setfenv(chunk, env)
  end
  -- A chunk named "=..." would be taken for one of Rapid's own.
  function env.load(text, name)
    native.outside_kernels("load", "its result can't be checked there")
    return load_text(text, "@" .. (type(name) == "string" and name:gsub("^[@=]", "") or "string given to load"))
  end
  env.loadstring = env.load

  local loaded, loading = {}, {}
  function env.require(name)
    if type(name) ~= "string" then error("require needs the name of a module", 2) end
    if loaded[name] ~= nil then return loaded[name] end
    native.outside_kernels("require", "call it first in the graph's body")
    if loading[name] then error(("module %q requires itself through other modules"):format(name), 2) end
    local text, where = native.read_module(name)
    if not text then error(("no module %q; looked for %s"):format(name, where), 2) end
    local chunk, message = load_text(text, where)
    if not chunk then error(message, 0) end
    loading[name] = true
    local result = run(chunk, where)
    loading[name] = nil
    loaded[name] = result == nil and true or result
    return loaded[name]
  end

  return env, loaded, load_text
end

assert(ffi.abi "gc64", "the host counts on frames of two slots")

return { make = make }
