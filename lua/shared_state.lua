-- State that all points share: the tables, functions and coroutines that a kernel can reach. A kernel must not change
-- them. Its bytecode shows most changes before it runs (lua/bytecode.lua); those that it hides, in a table of its own
-- or behind a coroutine, are found by comparing before and after its first points.
local protected = require "protected"

local getinfo, getlocal, getupvalue, getmeta = debug.getinfo, debug.getlocal, debug.getupvalue, debug.getmetatable

local max_values = 10000 -- compared at most: the walk takes a fraction of a millisecond

-- The values reached, in a fixed order, each with the name that leads to it.
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
    if self.count > max_values then return end
    self:note(key)
    self:note(value, key)
  end
  self:note(getmeta(map) or false, "its metatable")
end

local function is_ours(f)
  return getinfo(f, "S").source:find "^=%[rapid" ~= nil
end

-- Rapid's own functions hold no state for a script, except those that resume a coroutine.
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
  for level = 0, max_values do
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

-- Returns nil if there are too many values to compare.
local function walk(f, env)
  local self = setmetatable({ count = 0, values = {}, names = {}, seen = {}, open = {} }, Walk)
  self:note(f)
  self:note(env)
  while #self.open > 0 do
    local value = self.open[#self.open]
    self.open[#self.open] = nil -- not table.remove: LuaJIT would begin a trace in it
    self[type(value)](self, value)
    if self.count > max_values then return nil end
  end
  return self
end

-- Returns the first name of a walk that another lacks: a table that has grown changes its order.
local function new_name(walked, known)
  local names = {}
  for place = 1, known.count do names[known.names[place] or false] = true end
  for place = 1, walked.count do
    local name = walked.names[place]
    if name ~= nil and not names[name] then return name end
  end
end

-- Returns the name of the first value that differs, or nil. after: nil if there are too many now.
local function difference(before, after)
  if not after then return "it has grown" end
  for place = 1, math.max(before.count, after.count) do
    local a, b = before.values[place], after.values[place]
    if a ~= b and (a == a or b == b) or before.names[place] ~= after.names[place] then
      return new_name(after, before) or new_name(before, after) or after.names[place] or "a table"
    end
  end
end

-- Seldom called, so not worth a trace.
for _, f in ipairs { Walk.note, Walk.table, Walk["function"], Walk.thread, is_ours, walk, new_name, difference } do
  jit.off(f)
end

return { walk = walk, difference = difference }
