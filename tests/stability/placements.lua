-- Places every type of node at every position in a chain, by number.
--
--   local placements = require "tests.stability.placements"      from the folder of the project
--   placements.count
--   local text, name, place = placements.at(number)
--   placements.of(name)                                          numbers
local legal_nodes = require "tests.stability.legal_nodes"

local placements = {}

local given = ":attribute { own = 0.5, heat = 1, N = {0, 1, 0}, Cd = {1, 1, 1}, mass = 2, pscale = 0.05 } " ..
  ":group { name = \"some\", where = function(p) return p.id % 3 == 0 end } "
local emit = ":emit { source = rapid.mesh.sphere { radius = 0.5 }, rate = 240, life = {0.05, 0.3}, speed = 1, " ..
  "group = \"some\" } "
local create = "rapid.create { seed = 3 } "
local grid = "rapid.create { points = rapid.points.grid { size = {1, 0, 1}, spacing = 0.5 } } "
local parents = ":spawn { from = own, rate = 60, life = 0.1 } "
-- Another chain, also used as the second input of a merge. Its points lack attributes of the first chain's points.
local other = "local other = rapid.create { seed = 5 } :attribute { pscale = 0.02 } " .. emit

-- Name, chain, and the preceding chain `own`. NODE and NODE2 are replaced by the node.
local places = {
  { "before an emitter", create .. given .. "NODE" .. emit .. ":solve {}" },
  { "between emitter and solve", create .. given .. emit .. "NODE :solve {}" },
  { "after solve", create .. given .. emit .. ":solve {} NODE" },
  { "without solve", create .. given .. emit .. "NODE" },
  { "on initial points", grid .. given .. "NODE :solve {}" },
  { "on initial points without solve", grid .. given .. "NODE" },
  { "on no points", create .. given .. "NODE :solve {}" },
  { "on no points after solve", create .. given .. ":solve {} NODE" },
  { "on no points without solve", create .. given .. "NODE" },
  { "on points that are removed", create .. given .. emit ..
    ":delete { where = function() return true end } NODE :solve {}" },
  { "twice in a row", create .. given .. emit .. "NODE NODE2 :solve {}" },
  { "twice in a row after solve", create .. given .. emit .. ":solve {} NODE NODE2" },
  { "before and after solve", create .. given .. emit .. "NODE :solve {} NODE2" },
  { "after a merge", create .. given .. emit .. ":merge(other) NODE :solve {}" },
  { "on points that a merge brings in the frame before", create .. given .. emit .. "NODE :merge(other) :solve {}" },
  { "after a merge of solved points", create .. given .. emit .. ":solve {} :merge(other:solve {}) NODE" },
  { "before a merge", create .. given .. emit .. "NODE :solve {} :merge(other:solve {})" },
  { "in the chain that is merged", "other:solve {} :merge(" .. create .. given .. emit .. "NODE :solve {})" },
  { "in a chain of parents", create .. parents .. ":solve {}", create .. given .. emit .. "NODE :solve {}" },
  { "after the solve of parents", create .. parents .. ":solve {}", create .. given .. emit .. ":solve {} NODE" },
  { "on children", create .. given .. parents .. "NODE :solve {}", create .. emit .. ":solve {}" },
  { "on children of the same chain", "own" .. parents .. ":solve {}",
    create .. given .. emit .. "NODE" },
  { "in sub-frames", create .. given .. emit .. "NODE :solve { substeps = 2 }" },
  { "between two outputs", "{ main = own, after = own NODE }", create .. given .. emit .. ":solve {}" },
}

local names = {}
for name in pairs(legal_nodes.types) do
  if name ~= "create" then names[#names + 1] = name end
end
table.sort(names)

placements.count = #names * #places

function placements.at(number)
  local name, place = names[(number - 1) % #names + 1], places[math.floor((number - 1) / #names) + 1]
  legal_nodes.start(1, number, 1)
  local nodes = { NODE = legal_nodes.plain(name), NODE2 = legal_nodes.plain(name) }
  local text = other .. "\n" .. (place[3] and "local own = " .. place[3] .. "\n" or "") .. "return " .. place[2]
  text = text:gsub("NODE2?", nodes)
  if place[1] == "in sub-frames" then text = text:gsub("rapid%.create {", "%0 subframes = 3,") end
  return legal_nodes.with_head(text), name, place[1]
end

function placements.of(name)
  local numbers = {}
  for i, known in ipairs(names) do
    if known == name then
      for place = 0, #places - 1 do numbers[#numbers + 1] = place * #names + i end
    end
  end
  return numbers
end

return placements
