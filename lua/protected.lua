-- Lua's functions that call a script's functions, in the form that scripts see. LuaJIT's own can end the process:
--
--   pcall, xpcall   when they call each other they do not check the size of the stack; here each call has a Lua
--                   frame, which does
--   memory          an out-of-memory error that is caught in compiled code leaves a broken state; no protected call is
--                   compiled, and this error passes through all of them
--   C functions     those that call Lua, and coroutines, nest on the C stack, whose depth Lua does not limit; here
--                   it is
local describe = require "describe"

local out_of_memory = "not enough memory" -- LuaJIT's own message

local max_nested = 100
local nested = 0

local function enter(what)
  if nested == max_nested then
    error(("stack overflow: %s nested more than %d deep"):format(what, max_nested), 3)
  end
  nested = nested + 1
end

local function leave(...)
  nested = nested - 1
  return ...
end

-- Returns the results of a protected call, unless it ran out of memory.
local function caught(ok, message, ...)
  if not ok and message == out_of_memory then error(message, 0) end
  return ok, message, ...
end

local function result_of(ok, ...)
  if not ok then error((...), 0) end
  return ...
end

local protected = {}

function protected.pcall(f, ...)
  return caught(pcall(f, ...))
end

local function handled(handler, ok, ...)
  if ok then return ok, ... end
  return false, select(2, caught(pcall(handler, (...))))
end

-- Calls the handler after the stack is unwound: scripts have no means to look at it.
function protected.xpcall(f, handler, ...)
  if type(handler) ~= "function" then
    error("xpcall needs a function and an error handler, not " .. describe.kind(handler), 2)
  end
  return handled(handler, caught(pcall(f, ...)))
end

function protected.gsub(text, pattern, replacement, count)
  if type(replacement) ~= "function" and type(replacement) ~= "table" then
    return string.gsub(text, pattern, replacement, count)
  end
  enter "string.gsub"
  return result_of(leave(pcall(string.gsub, text, pattern, replacement, count)))
end

function protected.sort(list, before)
  if type(list) ~= "table" then
    error(("bad argument #1 to 'sort' (table expected, got %s)"):format(type(list)), 2)
  end
  enter "table.sort"
  return result_of(leave(pcall(table.sort, list, before)))
end

function protected.resume(thread, ...)
  if type(thread) ~= "thread" then error("coroutine.resume needs a coroutine, not " .. describe.kind(thread), 2) end
  enter "coroutines"
  return caught(leave(coroutine.resume(thread, ...)))
end

local wrapped = setmetatable({}, { __mode = "k" }) -- coroutines by the function that coroutine.wrap returned

function protected.wrap(f)
  if type(f) ~= "function" then error("coroutine.wrap needs a function, not " .. describe.kind(f), 2) end
  local thread = coroutine.create(f)
  local function run(...)
    enter "coroutines"
    return result_of(leave(coroutine.resume(thread, ...)))
  end
  wrapped[run] = thread
  return run
end

-- Returns the coroutine that a function from coroutine.wrap resumes; nil for any other function.
function protected.thread_of(f)
  return wrapped[f]
end

-- Returns true if a call of f with these arguments resumes a coroutine.
function protected.resumes(f, first)
  return wrapped[f] ~= nil or (f == protected.resume and first ~= nil)
end

-- Returns the position, from 0, of the first argument that f passes on to its first one; nil for other functions.
function protected.place_of_arguments(f)
  return f == protected.pcall and 1 or f == protected.xpcall and 2 or nil
end

for _, f in ipairs { "pcall", "xpcall", "gsub", "sort", "resume", "wrap" } do jit.off(protected[f]) end

return protected
