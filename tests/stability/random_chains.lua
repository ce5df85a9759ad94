-- Random graphs by number: chains of any nodes with moderate values, which merge, emit from each other, and end in
-- several outputs. Each number and seed gives the same text on every machine.
--
--   local random_chains = require "tests.stability.random_chains"      from the folder of the project
--   local text, outputs = random_chains.make(seed, number)             outputs: their names
local legal_nodes = require "tests.stability.legal_nodes"

local random_chains = {}

local draw, literal = legal_nodes.draw, legal_nodes.literal
local pick, chance, magnitude = draw.pick, draw.chance, draw.magnitude

local apart = { create = true, emit = true, merge = true, solve = true, spawn = true }
local any = {}
for name in pairs(legal_nodes.types) do
  if not apart[name] then any[#any + 1] = name end
end
table.sort(any)

-- Returns a node that emits from the points of another chain.
local function children_of(parents)
  local when = pick { ("rate = %s"):format(literal(magnitude(0, 2))), "count = 2", 'on = "death", count = 3',
    'on = "birth"', 'on = "hit"', 'on = "age > 0.1", kill_parent = true', 'on = "P.y < 0.2", limit = 1',
    "on = near, count = 2" }
  return ("  :spawn { from = %s, %s, life = %s%s }\n"):format(parents, when, pick { "0.1", "{0, 0.4}", "math.huge" },
    pick { "", ', inherit = {"own"}', ', group = "some"', ", attributes = { pscale = 0.1, own = {0, 1} }" })
end

-- Returns attributes that some chains have and others lack.
local function attributes()
  local given = { "own = " .. literal(draw.random()), "heat = 1", "N = {0, 1, 0}" }
  for _, value in ipairs { "pscale = 0.05", "mass = 3", "airresist = 0.1", "extra = 2", "Cd = {1, 0, 0}" } do
    if chance(0.3) then given[#given + 1] = value end
  end
  return ("  :attribute { %s }\n"):format(table.concat(given, ", "))
end

-- solved: names of finished chains; open: names of chains that have no Solve yet.
local function nodes_before_solve(solved, open)
  local text = ""
  for _ = 1, pick { 1, 2, 3, 4 } do
    if #solved > 0 and chance(0.15) then
      text = text .. children_of(pick(solved))
    elseif #open > 0 and chance(0.2) then
      text = text .. ("  :merge(%s)\n"):format(pick(open))
    elseif chance(0.3) then
      text = text .. legal_nodes.drawn "emit"
    else
      text = text .. legal_nodes.drawn(pick(any))
    end
  end
  return text
end

local function nodes_after_solve(solved)
  local text = ""
  while chance(0.4) do
    if #solved > 0 and chance(0.4) then
      text = text .. ("  :merge(%s)\n"):format(pick(solved))
    else
      text = text .. legal_nodes.drawn(pick(any))
    end
  end
  return text
end

local function create(number, subframes)
  local points = pick { "", "", ", points = rapid.points.grid { size = {0.4, 0, 0.4}, spacing = 0.2 }",
    ", points = rapid.points.from { P = {{0, 1, 0}, {0, 0, 0}}, v = {{1, 0, 0}, {0, 0, 0}}, mass = {2, 3}, " ..
      "rank = {4, 5} }" }
  return ("rapid.create { seed = %d, subframes = %d%s }\n"):format(number, subframes, points) ..
    (chance(0.8) and attributes() or "  :attribute { own = 0.5 }\n") ..
    '  :group { name = "some", where = function(p) return p.id % 3 == 0 end }\n'
end

function random_chains.make(seed, number)
  legal_nodes.start(seed, number, 1)
  local text, solved, open, outputs = "", {}, {}, {}
  local subframes = pick { 1, 1, 1, 2 }
  local chains = pick { 1, 2, 2, 3 }
  for k = 1, chains do
    local name = "chain" .. k
    text = text .. ("local %s = "):format(name) .. create(k, subframes) .. nodes_before_solve(solved, open)
    if k < chains and chance(0.25) then
      open[#open + 1] = name
    elseif chance(0.9) then
      text = text .. pick { "  :solve {}\n", "  :solve { substeps = 3 }\n", legal_nodes.drawn "solve" } ..
        nodes_after_solve(solved)
      solved[#solved + 1] = name
      if chance(0.3) then outputs[#outputs + 1] = name end
    elseif k < chains then
      open[#open + 1] = name
    end
  end
  local last = "chain" .. chains
  if outputs[#outputs] ~= last then outputs[#outputs + 1] = last end
  local returned = {}
  for i, name in ipairs(outputs) do returned[i] = ("%s = %s"):format(name, name) end
  return legal_nodes.with_head(("%sreturn { %s }"):format(text, table.concat(returned, ", "))), outputs
end

return random_chains
