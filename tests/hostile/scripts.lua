-- Random hostile scripts from a grammar: legal Lua that uses everything a script can reach, with unexpected values. The
-- text depends only on the seed.
--
--   local text = require "tests.hostile.scripts".make(seed)
local lehmer = require "tests.lehmer"

local Script = {}
Script.__index = Script

-- Returns a number from 1 to n.
function Script:random(n)
  return self.draw.below(n) + 1
end

function Script:one_of(list)
  return list[self:random(#list)]
end

local numbers = {
  "0", "-1", "1", "2", "0/0", "1/0", "-1/0", "2^31", "-2^31", "2^53", "1e308", "5e-324", "1.5", "-0.0", "3LL",
  "0x7fULL",
}
local names = { "P", "v", "id", "heat", "age", "mass", "index", "dt", "pscale", "orient", "nothing" }
local shared = {
  "S", "S.list", "math", "string", "table", "coroutine", "rapid", "_G", "vec3", "two", "ball", "mesh", "keeper",
  "class", "rapid.math", "bit",
}
local functions = {
  "print", "error", "assert", "pcall", "xpcall", "select", "type", "tostring", "tonumber", "next", "pairs", "ipairs",
  "unpack", "rawequal", "getmetatable", "setmetatable", "load", "require", "vec3", "quat", "string.rep", "string.gsub",
  "string.format", "string.find", "string.gmatch", "string.byte", "string.char", "string.sub", "table.insert",
  "table.remove", "table.sort", "table.concat", "table.move", "coroutine.wrap", "coroutine.create", "coroutine.resume",
  "coroutine.yield", "coroutine.status", "coroutine.running", "math.floor", "math.max", "math.fmod", "bit.lshift",
  "bit.tobit", "rapid.math.noise", "rapid.math.clamp", "rapid.shape.sphere", "rapid.shape.box", "rapid.mesh.box",
  "rapid.levelset.sphere", "rapid.points.from", "rapid.points.grid", "rapid.translate", "rapid.rotate", "rapid.ramp",
  "rapid.attr", "rapid.param", "rapid.create", "rapid.node", "keeper", "grow", "deep", "ball.distance", "class.new",
}

-- Generators of expressions; `depth` limits the nesting.
local expressions = {
  function(self) return self:one_of(numbers) end,
  function(self) return self:one_of(shared) end,
  function(self) return self:one_of(functions) end,
  function(self)
    return self:one_of { "nil", "true", "false", "'x'", "''", "'%p%s%d'", "'\\0\\255'", "self_", "a", "b" }
  end,
  function(self, depth) return ("(%s)(%s)"):format(self:one_of(functions), self:expressions(depth)) end,
  function(self, depth) return ("{ %s, [1] = %s, x = %s }"):format(self:expression(depth), self:expression(depth),
    self:expression(depth)) end,
  function(self, depth) return ("vec3(%s, %s, %s)"):format(self:expression(depth), self:one_of(numbers),
    self:one_of(numbers)) end,
  function(self, depth) return ("(%s %s %s)"):format(self:expression(depth),
    self:one_of { "+", "-", "*", "/", "%", "^", "..", "==", "<", "<=", "and", "or" }, self:expression(depth)) end,
  function(self, depth) return ("(%s)[%s]"):format(self:expression(depth), self:expression(depth)) end,
  function(self, depth) return ("(%s).%s"):format(self:expression(depth), self:one_of(names)) end,
  function(self, depth) return ("(%s):%s(%s)"):format(self:expression(depth), self:one_of { "rep", "gsub", "kill",
    "rand", "join", "within", "add", "sort", "distance", "gradient", "solve", "gravity", "length", "write",
    "transform" }, self:expressions(depth)) end,
  function(self, depth) return ("setmetatable(%s, { %s = %s, __index = %s })"):format(
    self:one_of { "{}", "{}", "{}", "{ 1 }", "S", "class" },
    self:one_of { "__newindex", "__call", "__add", "__lt", "__eq", "__concat", "__len", "__tostring", "__gc", "__mode",
    "__metatable", "__unm" }, self:expression(depth), self:one_of(shared)) end,
  function(self, depth) return ("function(a, b, ...) %s return %s end"):format(self:statement(depth),
    self:expression(depth)) end,
  function(self, depth) return ("pcall(%s, %s)"):format(self:expression(depth), self:expression(depth)) end,
  function(self, depth) return ("(coroutine.wrap(function(...) %s coroutine.yield(%s) end))(%s)"):format(
    self:statement(depth), self:expression(depth), self:expressions(depth)) end,
  function(self) return ("select(2, pcall(unpack, many(%s, %s)))"):format(self:one_of(functions),
    self:one_of { "10", "200", "7000" }) end,
  function(self)
    return ("deep(%s, %s)"):format(self:one_of { "5", "150", "1e5" }, self:one_of { "1", "2", "3", "4" })
  end,
}

function Script:expression(depth)
  if depth <= 0 then return expressions[self:random(4)](self, 0) end
  return (expressions[self:random(#expressions)](self, depth - 1))
end

function Script:expressions(depth)
  local list = {}
  for place = 1, self:random(4) - 1 do list[place] = self:expression(depth - 1) end
  return table.concat(list, ", ")
end

local statements = {
  function(self, depth) return ("local a = %s"):format(self:expression(depth)) end,
  function(self, depth) return ("pcall(function(...) local b = %s %s end)"):format(self:expression(depth),
    self:statement(depth)) end,
  function(self, depth)
    return ("for i = 1, %s do %s end"):format(self:one_of { "3", "200", "1e4" }, self:statement(depth))
  end,
  function(self, depth) return ("for k, v in %s(%s) do %s break end"):format(self:one_of { "pairs", "ipairs", "next," },
    self:expression(depth), self:statement(depth)) end,
  function(self, depth) return ("pcall(function() (%s)[%s] = %s end)"):format(self:expression(depth),
    self:expression(depth), self:expression(depth)) end,
  function(self, depth) return ("pcall(function() (%s).%s = %s end)"):format(self:expression(depth), self:one_of(names),
    self:expression(depth)) end,
  function(self, depth) return ("pcall(table.sort, %s, function(a, b) %s return %s end)"):format(self:one_of {
    "{ 3, 1, 2 }", "many(1, 100)", "S" }, self:statement(depth), self:expression(depth)) end,
  function(self, depth) return ("pcall(string.gsub, %s, %s, %s)"):format(self:one_of { "'xyz'", "('x'):rep(1e4)" },
    self:one_of { "'.'", "'%f[x]'", "'(.-)%1'", "('x?'):rep(50)" }, self:expression(depth)) end,
  function() return "grow()" end,
  function(self, depth) return ("if %s then %s end"):format(self:expression(depth), self:statement(depth)) end,
}

function Script:statement(depth)
  if depth <= 0 then return "local _ = 1" end
  return statements[self:random(#statements)](self, depth - 1)
end

function Script:block(count, depth)
  local lines = {}
  -- Most are protected, so that the code after an error also runs.
  for place = 1, count do
    local line = self:random(8) == 1 and "  do %s end" or "  pcall(function(...) %s end)"
    lines[place] = line:gsub("%%s", (self:statement(depth):gsub("%%", "%%%%")))
  end
  return table.concat(lines, "\n")
end

local head = [[
local rapid = require "rapid"
local two = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}}, heat = {1, 2} }
local ball, mesh, S, self_, a, b = rapid.shape.sphere {}, rapid.mesh.box {}, { list = { 1, 2 }, n = 0 }
local class = {} class.__index = class function class.new(x) return setmetatable({ x = x }, class) end
local keeper = coroutine.wrap(function(k) while true do k = coroutine.yield(k) or k end end)
local function many(x, n) local t = {} for i = 1, n do t[i] = x end return t end
local function grow() local t = {} for i = 1, 1e5 do t[i] = { i } end return t end
local function deep(n, how)
  if n <= 0 then return 1 end
  if how == 1 then return select(2, pcall(deep, n - 1, how)) end
  if how == 2 then return coroutine.wrap(deep)(n - 1, how) end
  if how == 3 then return (("x"):gsub("x", function() return deep(n - 1, how) end)) end
  table.sort({ 1, 2 }, function(x, y) deep(n - 1, how) return x < y end)
end
]]

local chains = {
  ":points('k', function(p, frame)\n%s\n  end)", ":action('k', function(p, step)\n%s\n  end)",
  ":delete { where = function(p)\n%s\n  return false end }", ":detail('k', function(points, frame)\n%s\n  end)",
  ":gravity { g = function(frame)\n%s\n  return vec3(0, -1, 0) end }",
  ":collide { shape = function(frame)\n%s\n  return ball end }",
}

local function make(seed)
  local self = setmetatable({ draw = lehmer.new() }, Script)
  self.draw.start(seed, 0)
  local text = head .. self:block(self:random(3) - 1, 3) .. "\nreturn rapid.create { points = two } "
  for place = 1, self:random(3) do
    -- The text of a block may contain percent signs.
    local before, after = self:one_of(chains):match "^(.-)%%s(.*)$"
    text = text .. before:gsub("'k'", ("'k%d'"):format(place)) .. self:block(self:random(4), 3) .. after .. "\n  "
  end
  return text .. ":solve {}\n"
end

return { make = make }
