-- What all points share: the tables, functions and coroutines that a kernel can reach. A kernel must leave them as they
-- are. Its bytecode shows most changes before it runs (lua/bytecode.lua); those that it hides, in a table of its own or
-- behind a coroutine, are found by comparing before and after its first points.
local protected = require "protected"

local getinfo, getlocal, getupvalue, getmeta = debug.getinfo, debug.getlocal, debug.getupvalue, debug.getmetatable

local most_values = 10000 -- that are compared: the walk takes a fraction of a millisecond

-- The values that are reached, in a fixed order, each with the name that it is kept under.
local Walk = {}
Walk.__index = Walk

function Walk:note(value, name)
  self.count = self.count + 1
  self.values[self.count], self.names[self.count] = value, name
  local kind = type(value)
  if (kind == "table" or kind == "function" or kind == "thread") and not self.seen[value] then
    self.seen[value] = true
    self.open[#self.open + 1] = value
  end
end

function Walk:table(map)
  for key, value in next, map do
    if self.count > most_values then return end
    self:note(key)
    self:note(value, key)
  end
  self:note(getmeta(map) or false, "its metatable")
end

local function is_ours(f)
  return getinfo(f, "S").source:find "^=%[rapid" ~= nil
end

-- Rapid's own functions keep nothing for a script, but for those that resume a coroutine.
Walk["function"] = function(self, f)
  local thread = protected.thread_of(f)
  if thread then self:note(thread, "a coroutine") end
  if is_ours(f) then return end
  for place = 1, 255 do
    local name, value = getupvalue(f, place)
    if not name then return end
    self:note(value, name)
  end
end

function Walk:thread(thread)
  self:note(coroutine.status(thread), "a coroutine")
  for level = 0, most_values do
    local info = getinfo(thread, level, "fl")
    if not info then return end
    self:note(info.func, "a coroutine")
    self:note(info.currentline, "a coroutine")
    for place = 1, 255 do
      local name, value = getlocal(thread, level, place)
      if not name then break end
      self:note(value, name)
    end
  end
end

-- Nil where there are too many values to compare.
local function walk(f, env)
  local self = setmetatable({ count = 0, values = {}, names = {}, seen = {}, open = {} }, Walk)
  self:note(f)
  self:note(env)
  while #self.open > 0 do
    local value = self.open[#self.open]
    self.open[#self.open] = nil -- not table.remove: LuaJIT would begin a trace in it
    self[type(value)](self, value)
    if self.count > most_values then return nil end
  end
  return self
end

-- The first name of a walk that is not in another: a table's order is another one when it has grown.
local function new_name(walked, known)
  local names = {}
  for place = 1, known.count do names[known.names[place] or false] = true end
  for place = 1, walked.count do
    local name = walked.names[place]
    if name ~= nil and not names[name] then return name end
  end
end

-- The name of the first value that differs; nil where none does. after: nil where there are too many now.
local function difference(before, after)
  if not after then return "it has grown" end
  for place = 1, math.max(before.count, after.count) do
    local a, b = before.values[place], after.values[place]
    if a ~= b and (a == a or b == b) or before.names[place] ~= after.names[place] then
      return new_name(after, before) or new_name(before, after) or after.names[place] or "a table"
    end
  end
end

-- Seldom called: no trace is worth its while.
for _, f in ipairs { Walk.note, Walk.table, Walk["function"], Walk.thread, is_ours, walk, new_name, difference } do
  jit.off(f)
end

return { walk = walk, difference = difference }
