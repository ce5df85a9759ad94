-- Generates calls of nodes with legal arguments from their declarations. A newly registered node is included without a
-- change here, unless it has a required parameter of a type that no other node has.
--
--   local legal_nodes = require "tests.stability.legal_nodes"      from the folder of the project
--   legal_nodes.start(seed, number)     restarts, with values over 18 decades
--   legal_nodes.start(seed, number, 1)  restarts, with values from 0.1 to 10
--   legal_nodes.types                   the declarations by name
--   legal_nodes.plain(name)             the text of a call with only the required arguments
--   legal_nodes.drawn(name)             the text of a call with random arguments
--
-- The text belongs after legal_nodes.head, or in legal_nodes.with_head(text), in a chain whose points have the float
-- `own` and the group `some`.
local command = require "testing.command"
local json = require "dkjson"
local lehmer = require "tests.lehmer"

local legal_nodes = {}

local draw = lehmer.new()
local random, pick, chance, magnitude = draw.random, draw.pick, draw.chance, draw.magnitude
legal_nodes.draw = draw
local widest, usual = 9, 2  -- decades above and below 1
local files = 0  -- number of files that the scene's nodes write

function legal_nodes.start(seed, number, decades)
  draw.start(seed, number)
  widest, usual, files = decades or 9, math.min(decades or 2, 2), 0
end

local function literal(x) return ("%.9g"):format(x) end
local function vector(low, high)
  local size = magnitude(low, high)
  local function component() return literal(pick { 0, 1, -1, 2 * random() - 1 } * size) end
  return ("{%s, %s, %s}"):format(component(), component(), component())
end
legal_nodes.literal, legal_nodes.vector = literal, vector

-- Definitions to which values refer. Level sets and grids need OpenVDB.
local scenery = {
  { "flow", [[rapid.grid.from { size = {2, 2, 2}, voxel = 0.5, at = function(P) return vec3(P.y, -P.x, P.z) end }]] },
  { "solid", [[rapid.levelset.box { size = {0.6, 0.4, 0.5}, voxel = 0.1 }]] },
  { "sheet", "rapid.mesh.from { points = {{-1, 0, -1}, {1, 0, -1}, {0, 0, 1}}, faces = {{1, 2, 3}}, "
    .. "values = { own = {0, 1, 2} } }" },
  { "near", [[function(p) return p.P:length() < 1 end]] },
}
legal_nodes.head = ""
for _, thing in ipairs(scenery) do legal_nodes.head = legal_nodes.head .. ("local %s = %s\n"):format(unpack(thing)) end

-- Prepends the definitions to which the text refers.
function legal_nodes.with_head(text)
  local head = ""
  for _, thing in ipairs(scenery) do
    if text:find("%f[%w]" .. thing[1] .. "%f[%W]") then head = head .. ("local %s = %s\n"):format(unpack(thing)) end
  end
  return head .. text
end

-- Texts of values by the registry's name of their type. Zeros and ones produce colliders without volume, and points on
-- surfaces and in their corners.
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
values["list of vec3, points, or curve"] = values["list of vec3"]
values["mesh, shape, points or rapid.attr"] = function()
  return pick { "rapid.mesh.box {}", "solid", "rapid.points.grid { spacing = 0.5 }" }
end
function values.node()
  return "rapid.create { seed = 9 } :emit { source = rapid.mesh.sphere { radius = 0.5 }, rate = 240, " ..
    "life = {0.05, 0.3} } :solve {}"
end
function values.mesh() return pick { "sheet", ("sheet:transform(%s)"):format(values.motion()) } end
values["mesh, level set, shape, fog, curve, points or vec3"] = function()
  return pick { "solid", "rapid.mesh.sphere { radius = 0.5 }", "rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}} }",
    ("rapid.mesh.box { size = {1, 0.1, 1} }:transform(%s)"):format(values.motion()) }
end
values["number or {min, max}"] = function()
  local least = magnitude(-4, 1)
  return pick { "0", literal(least), ("{%s, %s}"):format(literal(least), literal(least * 3)) }
end
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
  local x = pick { 0, 1, 1 } * pick { magnitude(-widest, widest), magnitude(-usual, usual) }
  if x == 0 and param.above_min then x = magnitude(-9, 0) end
  if low == -math.huge then x = pick { x, -x } end
  return literal(math.max(x, low))
end

-- Kernels that are correct at any step.
values["function of the points"] = function() return "function(points) points.detail.many = #points end" end
local kernels = { points = "function(p) p.v = p.v * 0.9 end", action = "function(p, step) p.v = p.v * 0.9 end" }

local types = {}
for _, node in ipairs(json.decode(command.rapid("nodes --json").stdout)) do types[node.name] = node end
legal_nodes.types = types

-- Returns a required string: the name of a group, or of a separate file.
local function string_of(name, param)
  if param.name ~= "file" then return '"some"' end
  files = files + 1
  return ('"written%d.####.%s"'):format(files, name == "rasterize" and "vdb" or "csv")
end

local function required_value(name, param)
  if param.choices then return ("%q"):format(param.choices[1]) end
  if param.type == "string" then return string_of(name, param) end
  if param.name == "kernel" and kernels[name] then return kernels[name] end
  if values[param.type] then return values[param.type](param) end
  error(("node %s: its parameter %s has the type %q, of which no value is known; give values[%q] in %s"):format(name,
    param.name, param.type, param.type, "tests/stability/legal_nodes.lua"), 0)
end

-- Returns the text of a parameter's value, or nil to omit it. Some values differ per point, some change with the frame.
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

local rule = {  -- for parameters that exclude each other
  field = function(given) if given.mode ~= '"velocity"' then given.drag = nil end end,
  attract = function(given) if given.shape then given.center = nil end end,
  emit = function(given)
    given.impulse, given.from, given.source_group, given.cut = nil, nil, nil, chance(0.1) and "{3}" or nil
    given.rate, given.count = nil, literal(math.floor(random() * 30))
    if chance(0.5) then given.rate, given.count = literal(pick { 0, magnitude(-2, 3) }), nil end
    if given.source:find "points" then given.speed = nil end
    given.group = chance(0.2) and '"some"' or nil
  end,
  spawn = function(given)
    given.on, given.min_speed, given.kill_parent, given.rate, given.count = nil, nil, nil, nil, "2"
  end,
  -- A level set's band as wide as the radius costs voxels, so the radius is small, or so large that it is refused.
  collide = function(given)
    if given.shape:find "solid" and given.radius then
      given.radius = literal(pick { magnitude(-9, 0), magnitude(-9, 0), magnitude(4, 9) })
    end
  end,
  delete = function(given) given.group = given.where == nil and '"some"' or given.group end,
  distance = function(given) given.pairs = nil given.within = literal(magnitude(-3, 0)) end,
  group = function(given) given.name = '"some"' end,
}


local special = { name = true, reads = true, writes = true }

local function call(name, given)
  local strings = {}
  if name == "merge" then return "  :merge(other)\n" end
  if types[name].other_params then strings[1] = "own = 0.25" end
  for _, param in ipairs(types[name].params) do
    if given[param.name] then strings[#strings + 1] = param.name .. " = " .. given[param.name] end
  end
  return ("  :%s { %s }\n"):format(name, table.concat(strings, ", "))
end

-- Returns a call with the required arguments and those that define the node's purpose.
function legal_nodes.plain(name)
  local given = {}
  for _, param in ipairs(types[name].params) do
    if param.required then given[param.name] = required_value(name, param) end
  end
  if rule[name] then rule[name](given) end
  return call(name, given)
end

function legal_nodes.drawn(name)
  local given = {}
  for _, param in ipairs(types[name].params) do
    if param.required and not values[param.type] then
      given[param.name] = required_value(name, param)
    elseif not special[param.name] and (param.required or chance(0.7)) then
      given[param.name] = value_of(param)
    end
  end
  if rule[name] then rule[name](given) end
  return call(name, given)
end

return legal_nodes
