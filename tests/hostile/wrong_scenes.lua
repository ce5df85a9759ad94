-- Scenes with one to three mistakes, by number. They are made from the scenes of graphs, those of the nodes, and random
-- ones (tests/stability): a name is misspelt, a value has the wrong type, range or shape, a parameter is missing, a
-- file does not exist, nodes form a cycle, or the program is not valid Lua. A seed gives the same text on every
-- machine.
--
--   local text, mistakes = require "tests.hostile.wrong_scenes".make(seed)      mistakes: their kinds, as a text
local command = require "testing.command"
local document = require "testing.document"
local json = require "dkjson"
local lehmer = require "tests.lehmer"
local random_scenes = require "tests.stability.random_scenes"

local draw = lehmer.new()
local pick = draw.pick

local nodes = json.decode(command.rapid("nodes --json").stdout)

local scenes = {}
for path in command.shell("ls graphs/*.lua graphs/nodes/*.lua").stdout:gmatch "[^\n]+" do
  scenes[#scenes + 1] = document.read(path)
end

-- The pieces of a program, { kind, text }, without its comments.
local patterns = {
  { "comment", "^%-%-[^\n]*" }, { "space", "^%s+" }, { "name", "^[%a_][%w_]*" }, { "number", "^%d[%w.]*" },
  { "string", '^"[^"\n]*"' }, { "string", "^'[^'\n]*'" }, { "sign", "^[=~<>]=" }, { "sign", "^%.%.%.?" },
  { "sign", "^." },
}

local function pieces_of(text)
  local pieces, at = {}, 1
  while at <= #text do
    for _, pattern in ipairs(patterns) do
      local found = text:match(pattern[2], at)
      if found then
        if pattern[1] ~= "comment" then pieces[#pieces + 1] = { kind = pattern[1], text = found } end
        at = at + #found
        break
      end
    end
  end
  return pieces
end

local function joined(pieces)
  local strings = {}
  for i, piece in ipairs(pieces) do strings[i] = piece.text end
  return table.concat(strings)
end

-- Definitions for wrong values: one line, after the scene's first.
local head = [[local loop = {} loop[1], loop.x, loop.P = loop, loop, loop local long = ("long"):rep(3e5) ]] ..
  [[local failing = setmetatable({}, { __index = function() error "of a metatable" end }) ]] ..
  [[local function late(f) if f.number > 1 then error "late" end return 1 end]]

local wrong_numbers = {
  "0/0", "1/0", "-1/0", "-1", "0", "-0.0", "0.5", "1e308", "-1e308", "5e-324", "1e-30", "1e12", "2^31", "2^53", "2^64",
}
local wrong_values = {
  "nil", "true", "false", "'x'", "''", "'\\27[2J'", "'a\\0b'", "long", "loop", "failing", "late", "print", "rapid",
  "{}",
  "{1}", "{1, 2}", "{1, 2, 3, 4}", "{'a', 'b', 'c'}", "{0/0, 0, 0}", "{1e308, 1e308, 1e308}", "{{1, 2, 3}}", "{x = 1}",
  "{nil, 2, 3}", "vec3(0/0, 1, 2)", "vec3(1/0, 0, 0)", "quat(0, 0, 0, 0)", "function() end",
  "function() return 'x' end",
  "function() return 0/0 end", "function(f) return f.nothing.x end", "coroutine.create(print)", "rapid.attr 'missing'",
  "rapid.attr ''", "rapid.attr 'P'", "rapid.mesh.box {}", "rapid.mesh.grid {}", "rapid.shape.plane {}", "3LL",
  "rapid.points.from { P = {} }", "rapid.translate(0, 0, 0)", "rapid.create {}", "{[1e9] = 1}", "{[-1] = loop}",
}

local function wrong_value()
  return pick(pick { wrong_numbers, wrong_values })
end

-- Mistakes in separate statements, before the scene is returned.
local statements = {
  'rapid.mesh.read "missing.obj"', 'rapid.mesh.read ""', 'rapid.mesh.read "scene.lua"', 'rapid.mesh.read "."',
  'rapid.mesh.read "m.####.obj"', 'rapid.mesh.read(long)', 'rapid.mesh.read(("x/"):rep(3000) .. "a.obj")',
  'rapid.points.read "missing.csv"', 'rapid.points.read "a\\0b.csv"', 'rapid.points.read "/dev/zero"',
  'rapid.points.read "\\27[2J.csv"', 'rapid.points.read "missing/.csv"', 'rapid.levelset.read "missing.vdb"',
  'rapid.grid.read "scene.lua"', 'rapid.grid.read("missing.vdb", { grid = 3 })', 'require "missing"', 'require "scene"',
  'require(long)', 'require "../scene"', 'rapid.points.from {}', 'rapid.points.from { P = {{1, 2}} }',
  'rapid.points.from { P = {{0, 0, 0}}, id = {1, 2} }', 'rapid.points.from { P = {{0, 0, 0}, {0, 0, 1}}, id = {3, 3} }',
  'rapid.points.from { P = loop }', 'rapid.points.from { P = {{0, 0, 0/0}} }', 'rapid.points.from { [long] = {1} }',
  'rapid.points.from { P = {[1e9] = {0, 0, 0}} }', 'rapid.points.grid { size = {1e9, 1e9, 1e9} }',
  'rapid.points.grid { spacing = 1e-300 }', 'rapid.levelset.sphere { voxel = 1e-9 }',
  'rapid.levelset.sphere { radius = 1e300 }', 'rapid.levelset.box { half_width = 1e9 }',
  'rapid.levelset.torus { radius = 1, tube = 1e9 }', 'rapid.levelset.from_mesh(rapid.mesh.grid {}, {})',
  'rapid.levelset.from_mesh(rapid.mesh.box {}, { voxel = 1e-6 })', 'rapid.levelset.sphere {} :offset(-50)',
  'rapid.levelset.sphere {} :resample(1e-7)', 'rapid.levelset.sphere {} :smooth { width = 1e9 }',
  'rapid.levelset.sphere {} :write ""', 'rapid.levelset.sphere {} :write "/proc/self/mem.vdb"',
  'rapid.levelset.sphere {} :union(3)', 'rapid.levelset.sphere {} :subtract(rapid.levelset.sphere { radius = 9 })',
  'rapid.levelset.from_points(rapid.points.from { P = {{1e30, 0, 0}} }, { radius = 1e-9 })',
  'rapid.mesh.from { points = {{0, 0, 0}}, faces = {{1, 2, 3}} }', 'rapid.mesh.from { points = loop, faces = loop }',
  'rapid.mesh.from { points = {{0, 0, 0}}, faces = {{1, 1, 1}} }', 'rapid.mesh.grid { divisions = 1e9 }',
  'rapid.mesh.from { points = {}, faces = {} }', 'rapid.mesh.sphere { divisions = 2 }', 'rapid.rotate({0, 0, 0}, 1)',
  'rapid.scale(0)', 'rapid.translate()', 'rapid.ramp {}', 'rapid.ramp(loop)', 'rapid.param("x", {})', 'rapid.param()',
  'rapid.param("x", 1) rapid.param("x", "y")', 'rapid.node { name = 3 }', 'rapid.node {}', 'rapid.study {}',
  'rapid.grid.from { at = function() return 1 end }', 'rapid.grid.from { at = function() error "at" end }',
  'rapid.grid.from { voxel = 1e-9, at = function(P) return P end }', 'rapid.shape.plane { normal = {0, 0, 0} }',
  'rapid.shape.sphere { radius = -1 }', 'rapid.shape.box { size = {0, 1, 1} }', 'rapid.shape.sphere {} :distance(3)',
  '("x"):rep(1e12)', '("x"):rep(1e6):rep(1e3)', 'error()', 'error {}', 'error(long)', 'error("\\27[2J")',
  'error(nil, 9)',
  'local function f() return f() + 1 end f()', 'local function g() return g() end g()', 'nothing()', 'nothing.x = 1',
  'rapid = nil', 'rapid.create = nil', 'math.huge = 1', 'loop()', 'string.format("%d", "x")', 'load("(")()', 'return',
  'return 5', 'return {}', 'return loop', 'return { a = rapid.create {}, b = 3 }', 'return rapid',
  'return rapid.create',
  'return { ["../x"] = rapid.create {} :solve {} }', 'return { [long] = rapid.create {} :solve {} }',
  'return rapid.create {}', 'return rapid.create { points = 3 }', 'coroutine.yield(1)', 'coroutine.wrap(error)()',
  'local n = rapid.create {} for i = 1, 40 do n = n:merge(n) end return n:solve {}',
  'local t = {} for i = 1, 1e9 do t[i] = i end', 'while true do end',
  'local function f(i) return i:points("x", function(p) end) end local n = rapid.create {} while true do n = f(n) end',
}

-- Mistakes in a chain.
local links = {
  ":gravty {}", ":gravity(3)", ":gravity()", ":gravity { gravity = {} }", ":merge(3)", ":merge()", ":merge(loop)",
  ":merge(rapid)", ":emit {}", ":emit { source = 3 }", ":emit { source = rapid.mesh.box {} }", ":collide {}",
  ":emit { source = rapid.mesh.box {}, rate = 1e18 }", ":emit { source = rapid.mesh.box {}, count = 1e9 }",
  ":emit { source = rapid.mesh.grid {}, from = 'volume', count = 1 }", ":emit { source = failing, count = 1 }",
  ":emit { source = rapid.mesh.box {}, count = 5, life = {2, 1} }",
  ":emit { source = rapid.mesh.box {}, impulse = { x = 3 } }",
  ":emit { source = rapid.mesh.box {}, impulse = { [2] = 1e12 } }",
  ":spawn { from = rapid.create {} :emit { source = rapid.mesh.box {}, rate = 9 } :solve {}, source_group = 'no' }",
  ":points(3)", ":points('x')", ":points('', function() end)", ":points(long, function(p) p.x = nil end)",
  ":points('x', function(p) p.v = p.missing end)", ":points('x', function(p) p.P = p.P / 0 end)",
  ":points('x', function(p) p.v = 3 end)", ":points('x', function(p) p.v = nil end)",
  ":points('x', function(p) p.id = 3 end)", ":points('x', function(p) p:kill(1):kill() end)",
  ":points('x', function(p) p:join(3) end)", ":points('x', function(p) p:rand() end)",
  ":points('x', function(p) p:rand(2 ^ 70, 'x') end)", ":points('x', function(p) error(p) end)",
  ":points('x', function(p) p[long] = 1 end)", ":points('x', function(p) loop.n = p end)",
  ":points('x', function(p) return p.x.y.z end)",
  ":points('x', function(p) local s = '' while true do s = s .. 'x' end end)",
  ":points('x', print)", ":points('x', math.sin)", ":points('x', coroutine.wrap(print))",
  ":action('x', function(p, step) p.force = vec3(0/0, 0, 0) end)", ":action('x', function(p) p.v = 1e300 * p.v end)",
  ":action('x', function(p) p.P = p.P + vec3(1e38, 0, 0) end)", ":action('x', function(p, step) p.v = step end)",
  ":group {}", ":group { name = '' }", ":group { name = '\\27[2J' }", ":group { name = 'P', where = print }",
  ":group { name = 'x', where = function(p) return p < 1 end }", ":delete {}", ":delete { group = 'missing' }",
  ":delete { where = 3 }", ":attribute { P = 1 }", ":attribute { heat = 'x' }", ":attribute { ['a b'] = 1 }",
  ":attribute { [long] = 1 }", ":attribute { heat = loop }", ":attribute { id = 3 }", ":attribute { mass = 0 }",
  ":attribute { mass = -1 } :contact { radius = 1 }", ":attribute { pscale = -1 } :contact {}",
  ":attribute { mass = 1e-40 }", ":distance { pairs = {{1, 1}} }", ":distance { pairs = {{0, 1e9}} }",
  ":distance { pairs = loop }", ":distance { within = 1e30 }", ":distance {}", ":pin {}", ":pin { group = 3 }",
  ":solve {} :solve {}", ":solve { substeps = 1e9 }", ":solve { tolerance = 0 }", ":solve { iterations = 0.5 }",
  ":write { file = '' }", ":write { file = 'a.xyz' }", ":write { file = 'a.csv' }",
  ":write { file = '/dev/full/#.csv' }",
  ":write { file = long .. '.####.csv' }", ":detail('x', function(points) points.P = nil end)",
  ":detail('x', function(points) return points[1e9].x end)", ":detail('x', function(points) points:add() end)",
  ":detail('x', function(points) for i = 1, 1e9 do points[i] = i end end)", ":detail('x', 3)",
  ":contact { radius = 1e30 }", ":contact { radius = 1e30, max_grids = 254, max_difference = 1e-30 }",
  ":clump { radius = 1e9 }", ":interact { radius = 1e-40, cohesion = 1 }",
  ":turbulence { octaves = 1e9 }", ":turbulence { size = 1e-300 }", ":field { grid = 3 }", ":spring { stiffness = -1 }",
  ":attract { center = {1e38, 1e38, 1e38}, strength = 1e38, falloff = -300 }", ":missing", ".missing {}", ":solve",
  "{}",
  ":collide { shape = late }", ":collide { shape = function() end }", ":collide { shape = loop }",
  ":collide { shape = rapid.shape.plane {}, transform = { [1] = 3 } }",
  ":collide { shape = rapid.shape.plane {}, transform = function() return 3 end }",
  ":collide { shape = rapid.shape.plane {}, transform = function(f) return rapid.scale(f.number - 2) end }",
  ":collide { shape = rapid.levelset.sphere {}, radius = 1e9 }", ":collide { shape = rapid.mesh.box {} }",
}

-- Returns the indices of the pieces for which `is_selected` returns true.
local function places(pieces, is_selected)
  local found = {}
  for i, piece in ipairs(pieces) do
    if is_selected(piece, i) then found[#found + 1] = i end
  end
  return found
end

local function of_kind(pieces, kind)
  return places(pieces, function(piece) return piece.kind == kind end)
end

-- Returns the next piece that is not blank.
local function next_piece(pieces, i)
  repeat i = i + 1 until not pieces[i] or pieces[i].kind ~= "space"
  return pieces[i] and pieces[i].text, i
end

-- Returns the end of the value that begins after piece i: the next comma or closing bracket.
local function end_of_value(pieces, i)
  local depth = 0
  while pieces[i + 1] do
    local text = pieces[i + 1].text
    if text == "(" or text == "{" or text == "[" or text == "function" then depth = depth + 1 end
    if depth == 0 and (text == "," or text == "}" or text == ")") then return i end
    if text == ")" or text == "}" or text == "]" or text == "end" then depth = depth - 1 end
    i = i + 1
  end
  return i
end

local function misspelt(name)
  local at = 1 + draw.below(#name)
  local before, letter, after = name:sub(1, at - 1), name:sub(at, at), name:sub(at + 1)
  return pick { before .. after, before .. letter .. letter .. after, before .. "x" .. after,
    before .. after:sub(1, 1) .. letter .. after:sub(2), name:upper() }
end

local function remove(pieces, first, last)
  for _ = first, last do table.remove(pieces, first) end
end

local function insert(pieces, at, text)
  table.insert(pieces, at, { kind = "mistake", text = " " .. text .. " " })
end

-- Each function makes a mistake, or none if there is no suitable position.
local mistakes = {}

function mistakes.name(pieces)
  local found = of_kind(pieces, "name")
  local piece = pieces[pick(found)]
  piece.text = misspelt(piece.text)
end

function mistakes.syntax(pieces)
  local at = pick(places(pieces, function(piece) return piece.kind ~= "space" end))
  pick {
    function() remove(pieces, at, at) end,
    function() insert(pieces, at, pieces[at].text) end,
    function() insert(pieces, at, pick { "(", ")", "{", "}", "end", "do", "=", "'", "[[", "--[[", "\\", "\0",
  "\255", "@" }) end,
    function() remove(pieces, at, #pieces) end,
  }()
end

function mistakes.number(pieces)
  local found = of_kind(pieces, "number")
  if #found > 0 then pieces[pick(found)].text = "(" .. pick(wrong_numbers) .. ")" end
end

function mistakes.text(pieces)
  local found = of_kind(pieces, "string")
  if #found > 0 then pieces[pick(found)].text = " (" .. wrong_value() .. ")" end
end

-- Mistakes in `name = value` within brackets.
local function given(pieces)
  local depth = 0
  return places(pieces, function(piece, i)
    if piece.text == "{" then depth = depth + 1 elseif piece.text == "}" then depth = depth - 1 end
    return depth > 0 and piece.kind == "name" and next_piece(pieces, i) == "="
  end)
end

function mistakes.value(pieces)
  local found = given(pieces)
  if #found == 0 then return end
  local _, equals = next_piece(pieces, pick(found))
  remove(pieces, equals + 1, end_of_value(pieces, equals))
  insert(pieces, equals + 1, wrong_value())
end

function mistakes.missing(pieces)
  local found = given(pieces)
  if #found == 0 then return end
  local at = pick(found)
  local last = end_of_value(pieces, at)
  remove(pieces, at, next_piece(pieces, last) == "," and last + 1 or last)
end

function mistakes.table(pieces)
  local found = places(pieces, function(piece) return piece.text == "{" end)
  if #found == 0 then return end
  local at = pick(found)
  pick {
    function() insert(pieces, at + 1, wrong_value() .. ",") end,
    function() insert(pieces, at + 1, "[" .. pick { "1", "0", "-1", "0.5", "2^53", "'x'", "loop", "true", "long" } ..
      "] = " .. wrong_value() .. ",") end,
    function() remove(pieces, at + 1, end_of_value(pieces, at)) end,
    function()
      remove(pieces, at, end_of_value(pieces, at) + 1)
      insert(pieces, at, "(" .. wrong_value() .. ")")
    end,
  }()
end

local function before_return(pieces)
  local found = places(pieces, function(piece) return piece.text == "return" end)
  return found[#found] or #pieces + 1
end

function mistakes.statement(pieces)
  insert(pieces, before_return(pieces), "do " .. pick(statements) .. " end")
end

-- Returns true before a call of a node, `:name {`.
local function in_chain(pieces, text)
  local found = places(pieces, function(piece, i)
    local _, name = next_piece(pieces, i)
    return piece.text == ":" and next_piece(pieces, name) == "{"
  end)
  if #found > 0 then insert(pieces, pick(found), text) end
end

function mistakes.link(pieces)
  in_chain(pieces, pick(links))
end

-- A node of the registry with one wrong parameter.
function mistakes.parameter(pieces)
  local node = pick(nodes)
  if #node.params == 0 then return end
  local param = pick(node.params)
  local strings = { param.name .. " = " .. wrong_value() }
  for _, other in ipairs(node.params) do
    if other.required and other ~= param and draw.chance(0.8) then
      strings[#strings + 1] = other.name .. " = "
        .. pick { wrong_value(), "1", "rapid.shape.plane {}", "function(p) end" }
    end
  end
  in_chain(pieces, (":%s { %s }"):format(node.name, table.concat(strings, ", ")))
end

local kinds = {}
for kind in pairs(mistakes) do kinds[#kinds + 1] = kind end
table.sort(kinds)

local function make(seed)
  draw.start(seed, 1)
  local text = pick(scenes)
  if draw.chance(0.5) then
    random_scenes.start(seed, 2)
    text = 'local rapid = require "rapid"\n' .. random_scenes.text()
  end
  text = text:gsub('(local rapid = require "rapid")', function(line) return line .. " " .. head end, 1)
  local pieces, made = pieces_of(text), {}
  for i = 1, 1 + draw.below(3) do
    made[i] = pick(kinds)
    mistakes[made[i]](pieces)
  end
  return joined(pieces), table.concat(made, ", ")
end

return { make = make }
