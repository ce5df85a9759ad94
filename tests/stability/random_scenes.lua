-- Scenes by number: every node there is, with legal values of every parameter over 18 decades. A number and a seed
-- give the same text everywhere.
--
--   local random_scenes = require "tests.stability.random_scenes"      from the folder of the project
--   random_scenes.start(seed, number)
--   random_scenes.text()               a scene of a few points; it takes `rapid` to be there
--   random_scenes.chunks()             a scene of thousands
--
-- pick, magnitude and the others draw what else a scene has.
local command = require "testing.command"
local json = require "dkjson"
local lehmer = require "tests.lehmer"

local random_scenes = {}

local draw = lehmer.new()
random_scenes.start = draw.start
local random, pick, chance, magnitude = draw.random, draw.pick, draw.chance, draw.magnitude
local function literal(x) return ("%.9g"):format(x) end
local function vector(low, high)
  local size = magnitude(low, high)
  local function component() return literal(pick { 0, 1, -1, 2 * random() - 1 } * size) end
  return ("{%s, %s, %s}"):format(component(), component(), component())
end

local head = [[
local flow = rapid.grid.from { size = {2, 2, 2}, voxel = 0.5, at = function(P) return vec3(P.y, -P.x, P.z) end }
local solid = rapid.levelset.box { size = {0.6, 0.4, 0.5}, voxel = 0.1 }
local function near(p) return p.P:length() < 1 end
]]

-- Texts of values by the type that the registry names. Colliders of no volume, points on surfaces and in their corners
-- come from zeros and ones.
local values = {}

function values.shape()
  return pick { "solid", "solid:transform(rapid.translate(0.1, 0, 0))",
    ("rapid.shape.plane { normal = %s, offset = %s }"):format(pick { "{0, 1, 0}", "{1, 2, -1}" },
      literal(pick { 0, random() - 1 })),
    ("rapid.shape.sphere { radius = %s, center = %s }"):format(literal(magnitude(-3, 1)), vector(-3, 1)),
    ("rapid.shape.box { size = {%s, 1, 0.5}, center = %s }"):format(literal(magnitude(-2, 1)), vector(-3, 1)) }
end
function values.motion()
  return pick { ("rapid.translate(0, %s, 0)"):format(literal(random() - 0.5)),
    ("function(f) return rapid.translate(0, %s * f.time, 0) end"):format(literal(magnitude(-3, 2))),
    ("function(f) return rapid.rotate({0, 0, 1}, %s * f.time) end"):format(literal(magnitude(0, 5))),
    "{ [1] = rapid.translate(0, 0, 0), [3] = rapid.translate(2, 0, 0) }" }
end
function values.boolean() return pick { "true", "false" } end
values["vec3"] = function() return vector(-4, 4) end
values["shape at rest or moving"] = function()
  return pick { values.shape(), values.shape(), ("solid:transform(%s)"):format(values.motion()),
    "rapid.mesh.box { size = {1, 0.1, 1} }",
    ("rapid.mesh.sphere { radius = 0.4 }:transform(%s)"):format(values.motion()) }
end
values["vec3, attribute or shape at rest or moving"] = function()
  return pick { vector(-4, 4), values["shape at rest or moving"]() }
end
values["vec3, attribute or moving shape"] = values.vec3
values["vector grid"] = function() return "flow" end
values["false or number"] = function() return pick { "false", "0", "1" } end
values["function of a point"] = function() return "near" end
values["name of an attribute"] = function() return '"own"' end
values["name of a group"] = function() return '"some"' end
values["list of vec3"] = function()
  return ("{{0, 0, 0}, %s, {1, 0, 0}, %s}"):format(vector(-3, 3), vector(-3, 3))
end
values["mesh, level set, shape, fog, curve, points or node"] = function()
  return pick { "solid", "rapid.mesh.sphere { radius = 0.5 }", "rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}} }",
    ("rapid.mesh.box { size = {1, 0.1, 1} }:transform(%s)"):format(values.motion()) }
end
values["number or {min, max}"] = function()
  local least = magnitude(-4, 1)
  return pick { "0", literal(least), ("{%s, %s}"):format(literal(least), literal(least * 3)) }
end
values["number or names"] = function() return literal(random()) end
values["number, {min, max} or rapid.attr"] = values["number or {min, max}"]
values.attributes = function() return ("{ own = %s }"):format(literal(random())) end
values["list of frames"] = function() return pick { "{}", "{3}" } end
function values.integer(param)
  local low = param.min or 0
  return literal(math.floor(low + random() * math.min(param.name == "octaves" and 4 or 9, (param.max or 1e9) - low)))
end
function values.number(param)
  local low, high = param.min or -math.huge, param.max or math.huge
  if high < math.huge then return literal(pick { low, high, low + (high - low) * random() }) end
  local x = pick { 0, 1, 1 } * pick { magnitude(-9, 9), magnitude(-2, 2) }
  if x == 0 and param.above_min then x = magnitude(-9, 0) end
  if low == -math.huge then x = pick { x, -x } end
  return literal(math.max(x, low))
end

local types = {}
for _, node in ipairs(json.decode(command.rapid("nodes --json").stdout)) do types[node.name] = node end

-- What is drawn here apart: which of several parameters is given, and how much a scene may cost.
local apart = {
  action = true, attribute = true, create = true, detail = true, merge = true, points = true, solve = true,
  rasterize = true, write = true,
}
local special = { name = true, reads = true, writes = true, kernel = true }

-- A parameter's value, as it is written; nil to leave it out. Some are each point's own, some change with the frame.
local function value_of(param)
  if param.name == "group" then return chance(0.1) and '"some"' or nil end
  local value
  if param.choices then
    value = ("%q"):format(pick(param.choices))
  elseif values[param.type] then
    value = values[param.type](param)
  end
  if not value or not (param.type == "number" or param.type == "vec3") then return value end
  if param.type == "number" and param.per_point and chance(0.1) then return 'rapid.attr "own"' end
  return param.of_the_frame and chance(0.1) and ("function() return %s end"):format(value) or value
end

local rule = { -- of parameters that exclude each other
  field = function(given) if given.mode ~= '"velocity"' then given.drag = nil end end,
  attract = function(given) if given.shape then given.center = nil end end,
  emit = function(given)
    for _, of_a_node in ipairs { "source_group", "on", "min_speed", "limit", "inherit_velocity", "split",
      "kill_parent" } do
      given[of_a_node] = nil
    end
    given.impulse, given.from, given.cut = nil, nil, chance(0.1) and "{3}" or nil
    given.rate, given.count = nil, literal(math.floor(random() * 30))
    if chance(0.5) then given.rate, given.count = literal(pick { 0, magnitude(-2, 3) }), nil end
    if given.source:find "points" then given.speed = nil end
    given.group = chance(0.2) and '"some"' or nil
  end,
  -- A band of a level set as wide as the radius costs its voxels: small ones, and some that are refused.
  collide = function(given)
    if given.shape:find "solid" and given.radius then
      given.radius = literal(pick { magnitude(-9, 0), magnitude(-9, 0), magnitude(4, 9) })
    end
  end,
  delete = function(given) given.group = given.where == nil and '"some"' or given.group end,
  distance = function(given) given.pairs = nil given.within = literal(magnitude(-3, 0)) end,
  group = function(given) given.name = '"some"' end,
}

local function node(name)
  local given, texts = {}, {}
  for _, param in ipairs(types[name].params) do
    if not special[param.name] and (param.required or chance(0.7)) then given[param.name] = value_of(param) end
  end
  if rule[name] then rule[name](given) end
  for _, param in ipairs(types[name].params) do
    if given[param.name] then texts[#texts + 1] = param.name .. " = " .. given[param.name] end
  end
  return ("  :%s { %s }\n"):format(name, table.concat(texts, ", "))
end

-- Kernels that are right at any step, and some that are not: their points may end infinite, which is an error.
local function kernel()
  return pick {
    '  :points("swirl", function(p) p.v = p.v + vec3(0, 1, 0):cross(p.P) * p.dt end)\n',
    '  :points("end", function(p) if p:rand(1) < 0.1 then p:kill() end end)\n',
    '  :points("join", function(p) if p.id % 2 == 0 then p:join "some" end p.own = p.own * 0.5 end)\n',
    ('  :action("pull", function(p) p.force = p.force - %s * p.P end)\n'):format(literal(magnitude(-6, 9))),
    ('  :action("slow", function(p, step) p.v = p.v * math.exp(-%s * step.dt) end)\n')
      :format(literal(magnitude(-6, 9))),
    '  :action("end", function(p) if p:rand(1) < 0.1 then p:kill() end end)\n',
  }
end

local names = { dynamic = { "contact", "distance", "pin", "clump", "interact" }, any = {},
  force = { "gravity", "drag", "wind", "turbulence", "attract", "vortex", "spring", "field" } }
for name in pairs(types) do if not apart[name] then names.any[#names.any + 1] = name end end
table.sort(names.any)

local function points(n)
  local P, v, mass, own = {}, {}, {}, {}
  local size, speed, heaviest = magnitude(-3, 5), pick { 0, magnitude(-3, 6) }, pick { 0, 3 }
  local function place(scale)
    return ("{%s, %s, %s}"):format(literal((2 * random() - 1) * scale), literal((2 * random() - 1) * scale),
      literal((2 * random() - 1) * scale))
  end
  for i = 1, n do
    P[i], v[i] = pick { place(size), place(size), "{0, 0, 0}", "{0.3, 0.2, 0}" }, place(speed)
    mass[i], own[i] = literal(magnitude(-heaviest, heaviest)), literal(random())
  end
  return ("rapid.points.from { P = {%s}, v = {%s}, mass = {%s}, own = {%s} }"):format(table.concat(P, ", "),
    table.concat(v, ", "), table.concat(mass, ", "), table.concat(own, ", "))
end

-- set: the initial points.
local function text_of(set)
  local text = ("local all = rapid.create { fps = %s, subframes = %d, seed = 3, points = %s }\n")
    :format(literal(pick { 24, 24, magnitude(-1, 6) }), pick { 1, 1, 1, 3 }, set)
  text = text .. ("  :attribute { own = 0.5, pscale = %s }\n"):format(literal(pick { 0, magnitude(-4, 0) }))
    .. '  :group { name = "some", where = function(p) return p.id % 3 == 0 end }\n'
  for _ = 1, pick { 1, 2, 3, 4 } do
    text = text .. (chance(0.2) and kernel() or node(chance(0.5) and pick(names.force) or pick(names.any)))
  end
  if chance(0.5) then text = text .. node "collide" end
  if chance(0.2) then text = text .. node(pick(names.dynamic)) end
  local solve = pick { "substeps = 1", "substeps = 3", "substeps = 16", "substeps = 4, iterations = 5",
    "tolerance = 1e-3, max_substeps = 16" }
  return ("%s%s  :solve { %s }\nreturn %s"):format(head, text, solve, chance(0.2) and "all:merge(all)" or "all")
end

-- Of a few points.
function random_scenes.text()
  return text_of(points(pick { 0, 1, 2, 20 }))
end

-- Of more points than a chunk of 4,096 holds.
function random_scenes.chunks()
  return text_of "rapid.points.grid { size = {40, 0.4, 0.3}, spacing = 0.1 }"
end

random_scenes.random, random_scenes.pick, random_scenes.magnitude = random, pick, magnitude
random_scenes.vector, random_scenes.head = vector, head

return random_scenes
