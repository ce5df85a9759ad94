-- Random scenes by number, with every node and legal values of every parameter over 18 decades. Each number and seed
-- gives the same text on every machine.
--
--   local random_scenes = require "tests.stability.random_scenes"      from the folder of the project
--   random_scenes.start(seed, number)
--   random_scenes.text()      a scene of a few points; requires a local `rapid`
--   random_scenes.chunks()    a scene of thousands
--
-- pick, magnitude and the others generate the rest of a scene.
local legal_nodes = require "tests.stability.legal_nodes"

local random_scenes = {}

local draw = legal_nodes.draw
local random, pick, chance, magnitude = draw.random, draw.pick, draw.chance, draw.magnitude
local literal, node = legal_nodes.literal, legal_nodes.drawn

function random_scenes.start(seed, number) legal_nodes.start(seed, number) end

-- Nodes that need special treatment: only one of several parameters may be given, or the cost must be limited.
local apart = {
  action = true, attribute = true, create = true, detail = true, merge = true, points = true, solve = true,
  rasterize = true, spawn = true, write = true,
}

-- Kernels that work for any step, and some whose points may become infinite, which is an error.
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
for name in pairs(legal_nodes.types) do if not apart[name] then names.any[#names.any + 1] = name end end
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
  return ("%s%s  :solve { %s }\nreturn %s"):format(legal_nodes.head, text, solve,
    chance(0.2) and "all:merge(all)" or "all")
end

-- Returns a scene with few points.
function random_scenes.text()
  return text_of(points(pick { 0, 1, 2, 20 }))
end

-- Returns a scene with more points than a chunk (4,096).
function random_scenes.chunks()
  return text_of "rapid.points.grid { size = {40, 0.4, 0.3}, spacing = 0.1 }"
end

random_scenes.random, random_scenes.pick, random_scenes.magnitude = random, pick, magnitude
random_scenes.vector, random_scenes.head = legal_nodes.vector, legal_nodes.head

return random_scenes
