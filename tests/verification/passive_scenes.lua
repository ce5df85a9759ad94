-- Scenes without energy sources, by number: coupled points, drag, springs, shapes at rest. Nodes that attract or drive
-- points permanently (wind, attract, vortex, turbulence, separation and attraction of interact) are excluded. Springs
-- and compliant rows have a potential.
--
--   local passive_scenes = require "tests.verification.passive_scenes"
--   local scene = passive_scenes.scene(seed, number)   a description, the same on every machine for a number and a seed
--   passive_scenes.text(scene)                         the scene as graph code; requires a local `rapid`
--   passive_scenes.simpler(scene)                      a list of scenes that are each simpler by one thing
--
-- Masses, radii, speeds and compliances vary over decades. Points start inside shapes and inside each other.
local lehmer = require "tests.lehmer"

local passive_scenes = {}

local drawn = lehmer.new()
local random, pick, chance, between, magnitude = drawn.random, drawn.pick, drawn.chance, drawn.between, drawn.magnitude
-- Rounds as the text does, so that the energy is that of the scene that runs.
local function short(x) return tonumber(("%.6g"):format(x)) end
local function vector(size)
  return { short(between(-size, size)), short(between(-size, size)), short(between(-size, size)) }
end

-- Initial positions, around the origin, where the shapes are.
local places = {}
function places.row(n, spacing)
  local P, along = {}, chance(0.5) and 0 or 1
  for i = 1, n do
    P[i] = { short((i - (n + 1) / 2) * spacing), along * short(0.3 * spacing * (i % 2)), 0 }
  end
  return P
end
function places.stack(n, spacing)
  local P = {}
  for i = 1, n do P[i] = { 0, short((i - 0.5) * spacing), 0 } end
  return P
end
function places.heap(n, spacing)
  local P = {}
  for i = 1, n do P[i] = vector(spacing * n ^ (1 / 3)) end
  return P
end
function places.together(n)
  local P = {}
  for i = 1, n do P[i] = { 0.1, 0.2, 0 } end
  return P
end

local function points(count, spacing, radius)
  local way = pick { "row", "row", "stack", "heap", "heap", "heap", chance(0.2) and "together" or "heap" }
  local P = places[way](count, spacing)
  local decades, speed = pick { 0, 0, 1, 3 }, pick { 0, magnitude(-1, 0.5), magnitude(0, 1.5) }
  local uneven, list = pick { 0, 0, 0.3 }, {}
  for i = 1, count do
    list[i] = {
      P = P[i], v = vector(speed), mass = short(magnitude(-decades, decades)),
      pscale = short(radius * magnitude(-uneven, uneven)),
    }
  end
  return list
end

local function pairs_of(list)
  local chosen, n = {}, #list
  local way = pick { "chain", "chain", "chain", "ring", "tree", "all" }
  for i = 2, n do
    if way == "all" then
      for j = 1, i - 1 do chosen[#chosen + 1] = { list[j], list[i] } end
    else
      chosen[#chosen + 1] = { list[way == "tree" and math.floor(random() * (i - 1)) + 1 or i - 1], list[i] }
    end
  end
  if way == "ring" and n > 2 then chosen[#chosen + 1] = { list[n], list[1] } end
  return chosen
end

local function some_of(list)
  local chosen = {}
  for _, point in ipairs(list) do
    if chance(0.2) then chosen[#chosen + 1] = point end
  end
  return #chosen > 0 and chosen or { list[1] }
end

local shapes = {
  function()
    return ("rapid.shape.plane { normal = {%.6g, 1, 0}, offset = %.6g }"):format(pick { 0, 0, between(-1, 1) },
      pick { 0, between(-0.5, 0) })
  end,
  function(size) return ("rapid.shape.sphere { radius = %.6g, center = {0, %.6g, 0} }")
    :format(size * between(0.3, 2), -size * between(0, 2)) end,
  function(size) return ("rapid.shape.box { size = {%.6g, %.6g, %.6g}, center = {0, %.6g, 0} }")
    :format(size * between(0.5, 4), size * between(0.5, 2), size * between(0.5, 4), -size * between(0, 2)) end,
  function(size) return ("rapid.levelset.torus { radius = %.6g, tube = %.6g, voxel = %.6g, center = {0, %.6g, 0} }")
    :format(2 * size, size, size / 8, -size * between(0, 1.5)) end,
  function(size) return ("rapid.levelset.box { size = {%.6g, %.6g, %.6g}, voxel = %.6g, center = {0, %.6g, 0} }")
    :format(4 * size, size, 4 * size, size / 8, -size * between(0, 1.5)) end,
  function(size)
    local voxel = size / 6
    return (("rapid.levelset.box { size = {%.6g, %.6g, %.6g}, voxel = %.6g }:subtract(" ..
      "rapid.levelset.sphere { radius = %.6g, voxel = %.6g })"):format(6 * size, 6 * size, 6 * size, voxel,
      size * between(1, 2.5), voxel))
  end,
}

-- Functions that generate the parameters of a node, by its name.
local draw = {}
function draw.contact()
  return { bounce = pick { 0, 0, 0.5, 0.9, 1 }, friction = pick { 0, 0, 0.3, 1 },
    mass_scaling = chance(0.05) and 1 or nil }
end
function draw.distance(scene)
  if chance(0.1) then return { within = short(scene.spacing * between(0.8, 2)), compliance = 0 } end
  return { pairs = pairs_of(scene.points), compliance = pick { 0, 0, 0, short(magnitude(-7, 0)) },
    rest = chance(0.1) and short(scene.spacing * between(0.5, 1.5)) or nil }
end
function draw.pin(scene)
  return { points = some_of(scene.points), compliance = pick { 0, 0, short(magnitude(-7, 0)) } }
end
function draw.clump() return { strength = short(magnitude(-1, 5)) } end
function draw.spring(scene)
  local node = { stiffness = short(magnitude(-1, 7)), damping = pick { 0, 0, short(magnitude(-2, 2)) } }
  if chance(0.4) then node.radius = short(scene.spacing * between(1, 5)) else node.target = vector(0.5) end
  return node
end
function draw.drag()
  return { linear = pick { 0, short(magnitude(-2, 3)) }, quadratic = pick { 0, short(magnitude(-2, 3)) } }
end
function draw.interact(scene)
  return { radius = short(scene.spacing * between(1, 3)), drag = short(magnitude(-1, 3)),
    alignment = pick { 0, short(magnitude(-1, 3)) } }
end
function draw.collide(scene)
  return { shape = pick(shapes)(scene.spacing * 2), bounce = pick { 0, 0.5, 1 }, friction = pick { 0, 0, 0.4, 1 },
    radius = pick { nil, nil, nil, 0 }, response = chance(0.2) and pick { "slide", "stick", "die" } or "bounce",
    method = chance(0.15) and pick { "backtrack", "project" } or "continuous" }
end

function passive_scenes.scene(seed, number)
  drawn.start(seed, number)
  local radius = short(magnitude(-2, -0.5))
  local scene = { fps = pick { 24, 24, 60 }, frames = 25, substeps = pick { 1, 2, 4, 8, 16, 32 },
    iterations = pick { 1, 1, 2, 4, 8 }, sleep = pick { 0.25, "math.huge" },
    g = pick { 0, 9.81, 9.81, 100 }, spacing = radius * pick { 1, 2, 2, 2.5, 4 }, nodes = {} }
  scene.points = points(pick { 1, 2, 2, 3, 5, 8, 20 }, scene.spacing, radius)
  local kinds = { #scene.points == 1 and "pin" or pick { "contact", "distance", "distance", "clump" } }
  for _, more in ipairs { { 0.25, "contact" }, { 0.2, "distance" }, { 0.2, "pin" }, { 0.1, "clump" }, { 0.2, "spring" },
    { 0.2, "drag" }, { 0.45, "collide" }, { 0.1, "collide" }, { 0.05, "interact" } } do
    if chance(more[1]) and (more[2] ~= "distance" or #scene.points > 1) then kinds[#kinds + 1] = more[2] end
  end
  for _, kind in ipairs(kinds) do
    local node = draw[kind](scene)
    node.kind = kind
    scene.nodes[#scene.nodes + 1] = node
  end
  return scene
end

local function written(value)
  if type(value) == "table" then return ("{%.9g, %.9g, %.9g}"):format(unpack(value)) end
  return type(value) == "number" and ("%.9g"):format(value) or value
end

-- Parameters of a node in the order of its text, and those whose values are words.
local params = { "stiffness", "damping", "linear", "quadratic", "strength", "shape", "bounce", "friction", "radius",
  "response", "method", "within", "rest", "compliance", "mass_scaling", "drag", "alignment", "target", "transform",
  "record" }
local words = { response = true, method = true }

local function node_text(node, place_of)
  local strings = {}
  if node.pairs then
    local list = {}
    for i, pair in ipairs(node.pairs) do list[i] = ("{%d, %d}"):format(place_of[pair[1]], place_of[pair[2]]) end
    strings[1] = ("pairs = {%s}"):format(table.concat(list, ", "))
  end
  for _, name in ipairs(params) do
    local value = node[name]
    if node.kind == "spring" and name == "radius" then
      local along = node.along and (":transform(%s)"):format(node.along) or ""
      if value then strings[#strings + 1] = ("target = rapid.shape.sphere { radius = %.9g }%s"):format(value, along) end
    elseif value then
      strings[#strings + 1] = ("%s = %s"):format(name, words[name] and ("%q"):format(value) or written(value))
    end
  end
  local group = ""
  if node.points then
    local list = {}
    for i, point in ipairs(node.points) do list[i] = ("p.id == %d"):format(place_of[point] - 1) end
    group = ('  :group { name = "held", where = function(p) return %s end }\n'):format(table.concat(list, " or "))
    table.insert(strings, 1, 'group = "held"')
  end
  return ("%s  :%s { %s }\n"):format(group, node.kind, table.concat(strings, ", "))
end

function passive_scenes.text(scene)
  local columns, place_of = { P = {}, v = {}, mass = {}, pscale = {} }, {}
  for i, point in ipairs(scene.points) do
    place_of[point] = i
    for name, column in pairs(columns) do column[i] = written(point[name]) end
  end
  local function column(name) return ("%s = {%s}"):format(name, table.concat(columns[name], ", ")) end
  local text = ("return rapid.create { fps = %d, points = rapid.points.from {\n    %s,\n    %s,\n    %s, %s } }\n")
    :format(scene.fps, column "P", column "v", column "mass", column "pscale")
  if scene.g > 0 then text = text .. ("  :gravity { g = {0, -%.9g, 0} }\n"):format(scene.g) end
  for _, node in ipairs(scene.nodes) do text = text .. node_text(node, place_of) end
  return text .. ("  :solve { substeps = %d, iterations = %d, sleep = %s }"):format(scene.substeps, scene.iterations,
    scene.sleep)
end

local function copy(value)
  local result = {}
  for key, item in pairs(value) do result[key] = item end
  return result
end

local function without(list, i)
  local result = copy(list)
  table.remove(result, i)
  return result
end

-- Returns the scene without a point, its pairs and its pins.
local function without_point(scene, i)
  local gone, result = scene.points[i], copy(scene)
  result.points, result.nodes = without(scene.points, i), {}
  for _, node in ipairs(scene.nodes) do
    local kept = copy(node)
    for _, list in ipairs { "pairs", "points" } do
      if node[list] then
        kept[list] = {}
        for _, item in ipairs(node[list]) do
          if item ~= gone and item[1] ~= gone and item[2] ~= gone then table.insert(kept[list], item) end
        end
        if #kept[list] == 0 then kept = nil break end
      end
    end
    if kept then table.insert(result.nodes, kept) end
  end
  return result
end

local function with(scene, name, value)
  local result = copy(scene)
  result[name] = value
  return result
end

-- The simplest values, by parameter of a node, a scene or a point.
local plain = { bounce = 0, friction = 0, damping = 0, linear = 0, quadratic = 0, compliance = 0,
  method = "continuous", response = "bounce" }

function passive_scenes.simpler(scene)
  local list = {}
  for i = 1, #scene.nodes do list[#list + 1] = with(scene, "nodes", without(scene.nodes, i)) end
  if #scene.points > 1 then
    for i = #scene.points, 1, -1 do list[#list + 1] = without_point(scene, i) end
  end
  if scene.g > 0 then list[#list + 1] = with(scene, "g", 0) end
  for _, change in ipairs { { "iterations", 1 }, { "substeps", 1 }, { "substeps", 4 }, { "sleep", "math.huge" },
    { "fps", 24 } } do
    local name, value = change[1], change[2]
    if scene[name] ~= value and not (name == "substeps" and scene.substeps < value) then
      list[#list + 1] = with(scene, name, value)
    end
  end
  for i, node in ipairs(scene.nodes) do
    for name, value in pairs(node) do
      if plain[name] and value ~= plain[name] then
        local nodes = copy(scene.nodes)
        nodes[i] = with(node, name, plain[name])
        list[#list + 1] = with(scene, "nodes", nodes)
      end
    end
    if node.pairs and #node.pairs > 1 then
      for j = 1, #node.pairs do
        local nodes = copy(scene.nodes)
        nodes[i] = with(node, "pairs", without(node.pairs, j))
        list[#list + 1] = with(scene, "nodes", nodes)
      end
    end
  end
  return list
end

return passive_scenes
