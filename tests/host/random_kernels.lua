-- Makes scenes of random kernels. A seed and a number give the same scene on every machine.
--
--   local random_kernels = require "tests.host.random_kernels"     from the folder of the project
--   random_kernels.start(seed, number)
--   local made = random_kernels.scene()      its statements as a tree, { kernels = ... }
--   random_kernels.text(made)                the scene; it expects that `rapid` exists
--   random_kernels.modules(made)             the Lua nodes that it uses: their source by name
--
-- Expressions and statements are expanded from templates (kernel_templates.lua).
local lehmer = require "tests.lehmer"
local templates = require "tests.host.kernel_templates"

local random_kernels = {}

local draw = lehmer.new(1)
random_kernels.start = draw.start
local pick, chance, below = draw.pick, draw.chance, draw.below

local kinds = {}
for kind in pairs(templates.plain) do kinds[#kinds + 1] = kind end
table.sort(kinds)

-- A scope contains the names of variables by kind, and these flags:
--   p, frame, params     these names exist
--   is_step, is_birth    the frame is the step of an action, or has no detail values
--   is_pure              the point must not be changed
--   computes_names       the node declares the attributes that are named by an expression
--   only_lanes           constructs that lane programs do not support are excluded
local function inner(scope)
  local result = { calls = {} }
  for name, value in pairs(scope) do result[name] = value end
  for _, kind in ipairs(kinds) do
    result[kind], result.calls[kind] = {}, scope.calls[kind]
    for k, name in ipairs(scope[kind] or {}) do result[kind][k] = name end
  end
  return result
end

local function is_possible(template, scope)
  if template:find "%f[%w]p[.:%[]" and not scope.p then return false end
  if template:find "%f[%w]frame" and not scope.frame then return false end
  if template:find "frame%.number" and scope.is_step then return false end
  if template:find "params" and not scope.params then return false end
  if template:find "p%[[$w]" and not scope.computes_names then return false end
  if template:find "frame%.detail" and scope.is_birth then return false end
  return true
end

local expression

local function expand(template, scope, depth)
  if scope.is_step then template = template:gsub("%f[%w]frame%f[%W]", "step") end
  return (template:gsub("%$(%u)", function(kind) return expression(kind, scope, depth - 1) end))
end

-- Returns a call of one of the scene's functions whose first result is of the kind; nil if there is none.
local function call(kind, scope, depth)
  local possible = {}
  for _, f in ipairs(scope.calls[kind] or {}) do
    if (scope.p or not f.p) and (scope.frame or not f.frame) and (f.is_pure or not scope.is_pure)
        and not (scope.only_lanes and not f.only_lanes) then
      possible[#possible + 1] = f
    end
  end
  if #possible == 0 then return nil end
  local f = pick(possible)
  local given = {}
  if f.p then given[1] = "p" end
  if f.frame then given[#given + 1] = scope.is_step and "step" or "frame" end
  for _, parameter in ipairs(f.parameters) do
    -- A missing argument is nil.
    if not (parameter == "M" and chance(0.1)) then given[#given + 1] = expression(parameter, scope, depth - 1) end
  end
  return ("%s(%s)"):format(f.name, table.concat(given, ", "))
end

function expression(kind, scope, depth)
  local names = scope[kind]
  if names and #names > 0 and chance(0.45) then return pick(names) end
  if depth > 0 and chance(0.2) then
    local text = call(kind, scope, depth)
    if text then return "(" .. text .. ")" end
  end
  local lists = depth > 0 and chance(0.85) and templates.composed or templates.atoms
  local list = lists(scope.only_lanes)[kind]
  for _ = 1, 20 do
    local template = pick(list)
    if is_possible(template, scope) then return expand(template, scope, depth) end
  end
  return templates.plain[kind]
end

-- A statement is a string, or a list of strings and blocks. A block is a list of statements with `is_block`.
local function block(list)
  list.is_block = true
  return list
end

local statements = {}

local function statement_list(scope, depth, count)
  local list = block {}
  for k = 1, count do
    local made
    repeat made = pick(statements)(scope, depth) until made
    list[k] = made
  end
  return list
end

local fresh = 0
local function new_name(kind)
  fresh = fresh + 1
  return kind:lower() .. fresh
end

local local_kinds = { "N", "N", "I", "V", "V", "Q", "B", "X", "X", "M", "M", "T", "F" }

local function declare(scope)
  local kind = pick(local_kinds)
  local value = expression(kind, scope, 2)
  local name = new_name(kind)
  table.insert(scope[kind], name)
  return ("local %s = %s"):format(name, value)
end

local function assign(scope)
  local kind = pick(local_kinds)
  if scope.only_lanes and kind == "F" then return nil end
  local names = scope[kind]
  if #names == 0 then return nil end
  return ("%s = %s"):format(pick(names), expression(kind, scope, 2))
end

local function observation_of(kind, name, scope)
  if scope.is_pure or not scope.p or scope.only_lanes and kind == "T" then return nil end
  return (templates.observations[kind]:gsub("%%s", name))
end

-- Stores a value that depends on one of the last variables of a kind.
local function observe(scope)
  local kind = pick(local_kinds)
  local names = scope[kind]
  return #names > 0 and observation_of(kind, names[#names - below(math.min(#names, 3))], scope) or nil
end

local function change(scope, list)
  if scope.is_pure or not scope.p then return nil end
  local template = pick(list)
  return is_possible(template, scope) and expand(template, scope, 3) or nil
end
local function store(scope) return change(scope, templates.stores(scope.only_lanes)) end
local function risky_store(scope) return change(scope, templates.risky) end

local function group_or_death(scope)
  if scope.is_pure or not scope.p then return nil end
  return pick { "p:join \"a\"", "p:leave \"b\"", "p:join \"b\"", "p:leave \"a\"", "p:kill()" }
end

local function branch(scope, depth)
  if depth == 0 then return nil end
  local made = { ("if %s then"):format(expression(pick { "B", "B", "B", "M" }, scope, 2)),
                 statement_list(inner(scope), depth - 1, 1 + below(2)) }
  if chance(0.2) then
    made[3] = ("elseif %s then"):format(expression("B", scope, 1))
    made[4] = statement_list(inner(scope), depth - 1, 1 + below(2))
  end
  if chance(0.5) then
    made[#made + 1] = "else"
    made[#made + 1] = statement_list(inner(scope), depth - 1, 1 + below(2))
  end
  made[#made + 1] = "end"
  return made
end

-- Makes two branches that leave values of different types in a local, and uses it.
local function mixture(scope, depth)
  if depth == 0 then return nil end
  local kind = pick { "X", "X", "M", "M", "F" }
  if scope.only_lanes and kind == "F" then return nil end
  local first, second = expression(kind, scope, below(2)), expression(kind, scope, below(2))
  local condition, name = expression("B", scope, below(2)), new_name(kind)
  table.insert(scope[kind], name)
  return { "local " .. name, ("if %s then"):format(condition), block { name .. " = " .. first }, "else",
           block { name .. " = " .. second }, "end", observation_of(kind, name, scope) }
end

local function loop(scope, depth)
  if depth == 0 then return nil end
  local within = inner(scope)
  local name = new_name "I"
  table.insert(within.I, name)
  local body = statement_list(within, depth - 1, 1 + below(2))
  if chance(0.3) then
    body[#body + 1] = { ("if %s then"):format(expression("B", within, 1)), block { "break" }, "end" }
  elseif chance(0.2) then
    table.insert(body, 1, { ("if %s then"):format(expression("B", within, 1)), block { "goto next" }, "end" })
    body[#body + 1] = "::next::"
  end
  local first = pick { "1, 3", "3, 1, -1", "1, 0", "0, 1, 0.25", "2, 2" }
  if not scope.only_lanes and chance(0.5) then
    first = pick { ("1, %s %% 4"):format(expression("I", scope, 1)), "1, #shared.list", "1, limit * 9" }
  end
  if scope.only_lanes or chance(0.7) then return { ("for %s = %s do"):format(name, first), body, "end" } end
  if chance(0.3) then return { ("for _, %s in ipairs(shared.list) do"):format(name), body, "end" } end
  -- A statement of the body may assign the loop variable.
  return { ("do local turns = 0 while turns < %d do turns = turns + 1 local %s = turns"):format(1 + below(3), name),
           body, "end end" }
end

local function return_statement(scope)
  local values = {}
  for k, kind in ipairs(scope.returns) do values[k] = expression(kind, scope, 2) end
  return "return " .. table.concat(values, ", ")
end

local function early_return(scope, depth)
  if depth == 0 or not scope.returns then return nil end
  local list = statement_list(inner(scope), depth - 1, below(2))
  list[#list + 1] = return_statement(scope)
  return { ("if %s then"):format(expression("B", scope, 2)), list, "end" }
end

-- Makes a function within the kernel that uses the locals around it.
local function nested(scope, depth)
  if depth == 0 or scope.only_lanes then return nil end
  local within = inner(scope)
  within.returns = { "N" }
  local argument, name = new_name "N", new_name "F"
  table.insert(within.N, argument)
  local body = statement_list(within, depth - 1, 1 + below(2))
  body[#body + 1] = return_statement(within)
  table.insert(scope.F, name)
  return { ("local function %s(%s)"):format(name, argument), body, "end" }
end

-- Takes two results of a call, which may have fewer or more.
local function unpacked(scope)
  local kind = pick { "N", "V", "B", "Q" }
  local text = call(kind, scope, 2)
  if not text then return nil end
  local a, b = new_name(kind), new_name "M"
  table.insert(scope[kind], a)
  table.insert(scope.M, b)
  return ("local %s, %s = %s"):format(a, b, text)
end

for _, weighted in ipairs { { declare, 5 }, { assign, 4 }, { store, 8 }, { observe, 9 }, { group_or_death, 1 },
                            { branch, 4 }, { mixture, 3 }, { loop, 1 }, { early_return, 1 }, { nested, 1 },
                            { unpacked, 1 } } do
  for _ = 1, weighted[2] do statements[#statements + 1] = weighted[1] end
end

-- Makes a function that kernels call, and adds it to scope.calls.
local function helper(number, scope)
  local f = { name = "helper" .. number, parameters = {}, only_lanes = scope.only_lanes, p = chance(0.4) }
  f.frame, f.is_pure = f.p and chance(0.3), chance(0.5)
  local within = inner(scope)
  within.p, within.frame, within.is_pure, within.params = f.p, f.frame, f.is_pure, false
  within.is_birth = true -- it may be called in any kernel
  local names = {}
  if f.p then names[1] = "p" end
  if f.frame then names[#names + 1] = "frame" end
  for k = 1, below(4) do
    local kind = pick { "N", "N", "V", "Q", "B", "X", "M" }
    local name = new_name(kind)
    names[#names + 1], f.parameters[k] = name, kind
    table.insert(within[kind], name)
  end
  within.returns = {}
  for k = 1, 1 + below(3) do within.returns[k] = pick { "N", "N", "V", "Q", "B", "X", "M" } end
  local body = statement_list(within, 2, below(3))
  body[#body + 1] = return_statement(within)
  local calls = scope.calls[within.returns[1]] or {}
  scope.calls[within.returns[1]] = calls
  calls[#calls + 1] = f
  return { ("local function %s(%s)"):format(f.name, table.concat(names, ", ")), body, "end" }
end

local places = { "points", "points", "points", "points", "vararg", "group", "action", "delete", "node" }

-- Returns a kernel: its position in the chain, and its body.
local function kernel(number, scope, given_place)
  local place = given_place or pick(places)
  local within = inner(scope)
  within.p, within.frame, within.is_step = true, place ~= "delete", place == "action"
  within.is_pure, within.params, within.is_birth = place == "delete", place == "node", place == "birth"
  within.computes_names = place ~= "delete" and place ~= "node" and place ~= "birth"
  within.returns = place == "delete" and { pick { "B", "B", "M" } } or {}
  local body = statement_list(within, 3, 2 + below(5))
  if chance(0.15) then
    local wrong = risky_store(within)
    if wrong and chance(0.5) then
      wrong = { ("if %s then"):format(expression("B", within, 2)), block { wrong }, "end" }
    end
    body[#body + 1] = wrong
  end
  for _ = 1, below(4) do body[#body + 1] = observe(within) end
  if place == "delete" then body[#body + 1] = return_statement(within) end
  return { place = place, number = number, body = body }
end

local sizes = { 3, 31, 32, 33, 60, 100, 127, 128, 129, 200, 256, 257, 300 }

function random_kernels.scene()
  fresh = 0
  local scope = inner { calls = {}, only_lanes = chance(0.7) }
  local made = { helpers = block {}, kernels = {}, size = pick(sizes), is_emitted = chance(0.15) }
  if chance(0.03) then made.size = 4200 end -- two chunks
  for k = 1, below(4) do made.helpers[k] = helper(k, scope) end
  for k = 1, 1 + below(3) do made.kernels[k] = kernel(k, scope) end
  if made.is_emitted and chance(0.5) then made.kernels[#made.kernels + 1] = kernel(0, scope, "birth") end
  return made
end

local function write(lines, made, indent)
  if type(made) == "string" then
    lines[#lines + 1] = indent .. made
  else
    for _, part in ipairs(made) do write(lines, part, made.is_block and indent .. "  " or indent) end
  end
end

local function lines_of(made, indent)
  local lines = {}
  write(lines, made, indent)
  return table.concat(lines, "\n")
end

function random_kernels.text(made)
  local sizes_and_names = ("local size, names = %d, { \"f\", \"g\" }"):format(made.size)
  local text = { templates.head, lines_of(made.helpers, ""), sizes_and_names, templates.points }
  if made.is_emitted then
    local birth = "\"random\""
    for _, one in ipairs(made.kernels) do
      if one.place == "birth" then birth = "function(p, frame)\n" .. lines_of(one.body, "    ") .. "\n  end" end
    end
    text[#text + 1] = ([[
return rapid.create { seed = 4 }
  :emit { source = rapid.points.from { P = list.P }, rate = %d, birth = %s, life = {0.1, 3}, spread = 60,
          velocity = {1, 2, 3}, attributes = { Cd = {0.1, -0.2, 3}, f = -0.75 } }]]):format(made.size * 24, birth)
  else
    text[#text + 1] = "return rapid.create { seed = 4, points = rapid.points.from(list) }"
  end
  text[#text + 1] = templates.graph
  for _, one in ipairs(made.kernels) do
    local opening = templates.openings[one.place]
    if opening then text[#text + 1] = opening:format(one.number, one.number) end
    if opening and one.place ~= "node" then
      text[#text + 1] = lines_of(one.body, "    ")
      text[#text + 1] = "  end }"
    end
  end
  text[#text + 1] = "  :solve {}"
  return table.concat(text, "\n")
end

function random_kernels.modules(made)
  local modules = {}
  for _, one in ipairs(made.kernels) do
    if one.place == "node" then
      local functions = templates.head .. lines_of(made.helpers, "")
      modules["knob" .. one.number] = templates.node:format(functions, one.number, lines_of(one.body, "    "))
    end
  end
  return modules
end

return random_kernels
