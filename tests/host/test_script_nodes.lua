-- rapid.node: nodes defined in Lua, found next to the graph and on RAPID_PATH, with the checks of native nodes.
local scene = require "testing.scene"

local push = [[
local rapid = require "rapid"

return rapid.node {
  name = "push", doc = "Pushes points.",
  params = {
    strength = { "float", default = 1, min = 0, max = 10, unit = "m/s", doc = "added to the velocity" },
    axis = { "vec3", default = {0, 1, 0}, doc = "direction" },
    times = { "int", default = 1, doc = "how often" },
    reverse = { "bool", default = false, doc = "the other way" },
    mode = { "string", default = "add", choices = { "add", "set" }, doc = "what is done to the velocity" },
  },
  points = function(p, frame, params)
    local by = params.axis * (params.strength * params.times)
    if params.reverse then by = -by end
    p.v = params.mode == "add" and p.v + by or by
  end,
}
]]

local function pushed(options)
  scene.folder:write("push.lua", push)
  return scene.run(("return rapid.create { points = two } :push%s :solve {}"):format(options))
end

describe("a node written in Lua", function()
  it("acts with its defaults, and with given parameters", function()
    for options, expected in pairs {
      ["{}"] = {0, 2, 0}, ["()"] = {0, 2, 0}, ["{ strength = 2 }"] = {0, 4, 0}, ["{ axis = {1, 0, 0} }"] = {2, 0, 0},
      ["{ axis = vec3(1, 0, 0), times = 3 }"] = {6, 0, 0}, ["{ reverse = true }"] = {0, -2, 0},
      ["{ mode = 'set' }"] = {0, 1, 0},
    } do
      assert.near(expected, pushed(options)[3][1].v, 1e-6)
    end
  end)

  it("takes functions of the frame, a group and a name", function()
    assert.near({0, 2 + 3, 0}, pushed "{ strength = function(frame) return frame.number end }"[3][1].v, 1e-6)
    scene.folder:write("push.lua", push)
    local result = scene.run [[
return rapid.create { points = two } :group { name = "right", where = function(p) return p.P.x > 0.5 end }
  :push { group = "right", name = "first" } :push { strength = 10, name = "second" } :solve {}]]
    assert.near({0, 10, 0}, result[2][1].v, 1e-6)
    assert.near({0, 11, 0}, result[2][2].v, 1e-6)
  end)

  it("has its parameters checked as a native node has", function()
    scene.folder:write("push.lua", push)
    for options, expected in pairs {
      ["{ strenght = 2 }"] = 'node "push1": unknown parameter "strenght"; did you mean "strength"?',
      ["{ strength = -1 }"] = 'node "push1": strength = -1 is out of range; it must be from 0 to 10',
      ["{ strength = 'much' }"] = 'node "push1": strength = "much" has the wrong type; it must be a number',
      ["{ times = 1.5 }"] = 'node "push1": times = 1.5 is not whole; it must be an integer',
      ["{ axis = 3 }"] = 'node "push1": axis = 3 has the wrong type; it must be a vec3 or {x, y, z}',
      ["{ reverse = 1 }"] = 'node "push1": reverse = 1 has the wrong type; it must be a boolean',
      ["{ mode = 'ad' }"] = 'node "push1": mode = "ad"',
      ["{ strength = function() return 11 end }"] = 'node "push1": strength = 11 is out of range; it must be from 0 ' ..
        "to 10 (frame 1)",
      ["{ group = 'hot' }"] = 'node "push1": no node makes a group "hot"',
      ["(3)"] = ":push needs a table of parameters: :push{ ... }",
      ["{ 3 }"] = 'node "push1": 3 has no name; write { NAME = value, ... }',
      ["{ kernel = print }"] = 'node "push1": unknown parameter "kernel"',
    } do
      local result = scene.command("check", ("return rapid.create { points = two } :push%s :solve {}"):format(options))
      assert.equal("scene.lua:1: " .. expected, result.stderr:sub(1, #expected + 13))
      assert.equal(2, result.status)
    end
  end)

  it("shows an error with its own line, and the node of the graph", function()
    scene.folder:write("fails.lua", [[
local rapid = require "rapid"
return rapid.node { name = "fails", doc = "Fails.",
  params = { by = { "float", default = 1, doc = "amount" } },
  points = function(p, frame, params)
    p.v = p.v * params.yb
  end }]])
    assert.equal('fails.lua:5: node "late": no parameter "yb"; the node has by (point id 0, frame 2)',
      scene.error "return rapid.create { points = two } :fails { name = 'late' } :solve {}")
    scene.folder:write("fails.lua", [[
local rapid = require "rapid"
return rapid.node { name = "fails", doc = "Fails.",
  params = { by = { "float", default = 1, doc = "amount" } },
  points = function(p, frame, params)
    params.by = 2
  end }]])
    assert.equal("fails.lua:5: node \"fails1\": params.by can't be assigned; parameters are set by the graph",
      scene.error "return rapid.create { points = two } :fails {} :solve {}")
    scene.folder:write("fails.lua", [[
local rapid = require "rapid"
return rapid.node { name = "fails", doc = "Fails.",
  params = { by = { "float", default = 1, doc = "amount" } },
  detail = function(points, frame, params)
    params.by = points:sum "id"
  end }]])
    assert.equal("fails.lua:5: node \"fails1\": params.by can't be assigned; parameters are set by the graph",
      scene.error "return rapid.create { points = two } :fails {} :solve {}")
    scene.folder:write("fails.lua", [[
local rapid = require "rapid"
return rapid.node { name = "fails", doc = "Fails.", points = function(p) p.v = p.v * p.haet end }]])
    assert.equal('fails.lua:2: node "fails1": no attribute "haet"; did you mean "heat"? ' ..
      "(or add :attribute{ haet = 0 } before it)",
      scene.error "return rapid.create { points = two } :attribute { heat = 1 } :fails {} :solve {}")
    scene.folder:write("fails.lua", [[
local rapid = require "rapid"
local n = 0
return rapid.node { name = "fails", doc = "Fails.", points = function(p)
  n = n + 1
end }]])
    assert.truthy(scene.error "return rapid.create { points = two } :fails {} :solve {}"
      :find('fails.lua:4: node "fails1": the kernel assigns the upvalue "n"', 1, true))
  end)

  it("keeps its own random numbers, by the name of the node", function()
    scene.folder:write("jitter.lua", [[
local rapid = require "rapid"
return rapid.node { name = "jitter", doc = "Shakes points.", points = function(p) p.v = vec3(p:rand(1), 0, 0) end }]])
    local one = scene.run "return rapid.create { points = two } :jitter { name = 'a' } :solve {}"
    local other = scene.run "return rapid.create { points = two } :jitter { name = 'b' } :solve {}"
    local kernel = scene.run [[
return rapid.create { points = two } :points("a", function(p) p.v = vec3(p:rand(1), 0, 0) end) :solve {}]]
    assert.same_points(kernel[3], one[3])
    assert.not_equal(one[3][1].v.x, other[3][1].v.x)
  end)

  it("made of nodes acts as they do", function()
    scene.folder:write("falling.lua", [[
local rapid = require "rapid"
return rapid.node { name = "falling", doc = "Gravity and a floor.",
  params = {
    pull = { "float", default = 10, doc = "downward" },
    floor = { "float", default = 0, doc = "height of the floor" },
  },
  expand = function(input, params)
    return input:gravity { g = {0, -params.pull, 0} }
      :collide { shape = rapid.shape.plane { offset = params.floor }, bounce = 0 }
  end }]])
    local result = scene.run("return rapid.create { points = two } :falling { floor = 0.5 } :solve {}",
      { frames = {2, 48} })
    -- x = g t²/2 in the first frame, at rest on the floor at the end.
    assert.near(1 - 10 / 24 / 24 / 2, result[2][1].P.y, 1e-6)
    assert.near(0.5, result[48][1].P.y, 1e-6)
    assert.equal('scene.lua:1: node "falling": unknown option "flor"; did you mean "floor"?',
      scene.error "return rapid.create { points = two } :falling { flor = 1 } :solve {}")
  end)

  it("is used in every state, whatever the number of threads", function()
    scene.folder:write("push.lua", push)
    local text = [[
return rapid.create { points = rapid.points.grid { size = {30, 30, 30}, spacing = 1 } }
  :push { axis = {1, 2, 3} } :push { strength = function(frame) return frame.number end } :solve {}]]
    local one = scene.run(text, { threads = 1 })
    assert.same_points(one[3], scene.run(text, { threads = 7 })[3])
    assert.near({2, 2 * 2 + 5, 3 * 2}, one[3]:max "v", 1e-5)
  end)
end)

describe("the file of a Lua node", function()
  it("is found next to the graph before RAPID_PATH, and there before Rapid's own", function()
    os.execute("mkdir -p " .. scene.folder:file "shared")
    local rises = [[
local rapid = require "rapid"
return rapid.node { name = "%s", doc = "Rises.", points = function(p) p.P = p.P + vec3(0, %d, 0) end }]]
    scene.folder:write("shared/rise.lua", rises:format("rise", 100))
    local run = function(node)
      local result = scene.command("run", "return rapid.create { points = two } :" .. node .. " {} :solve {}",
        "-f 2 -o a.####.csv --quiet", { environment = { RAPID_PATH = scene.folder:file "shared" } })
      assert.equal("", result.stderr)
      return scene.folder:read("a.0002.csv"):match "\n0,0,(%d+),"
    end
    assert.equal("101", run "rise")
    scene.folder:write("rise.lua", rises:format("rise", 10))
    assert.equal("11", run "rise")
    -- Rapid has its own node `lift`.
    scene.folder:write("shared/lift.lua", rises:format("lift", 100))
    assert.equal("101", run "lift")
    os.remove(scene.folder:file "shared/lift.lua")
    assert.truthy(scene.error("return rapid.create { points = two } :lift {} :solve {}"):find 'no attribute "heat"')
  end)

  it("must define the node that it is named after", function()
    for text, expected in pairs {
      ["return 5"] = "scene.lua:1: strange.lua does not return rapid.node{ name = \"strange\", ... }",
      [""] = "scene.lua:1: strange.lua does not return rapid.node{ name = \"strange\", ... }",
      ["return require 'rapid'.node { name = 'stranger', doc = 'x', points = function(p) end }"] =
        "scene.lua:1: strange.lua does not return rapid.node{ name = \"strange\", ... }",
      ["local x = "] = "strange.lua:1: unexpected symbol near '<eof>'",
      ["\nerror 'not today'"] = "strange.lua:2: not today",
    } do
      scene.folder:write("strange.lua", text)
      assert.equal(expected, scene.error("return rapid.create {} :strange {}"), text)
    end
  end)

  it("is refused for a fault of its declaration, at the line of rapid.node", function()
    local before = 'local rapid = require "rapid"\n'
    local points = "points = function(p) end"
    local roles = 'rapid.node "odd": the function is missing; add one of points = function(p, frame, params), ' ..
      "action = function(p, step, params), detail = function(points, frame, params) and expand = " ..
      "function(input, params)"
    for definition, expected in pairs {
      ["5"] = "rapid.node needs a table",
      ["{ doc = 'x', " .. points .. " }"] = "rapid.node: the name is missing",
      ["{ name = 5, doc = 'x', " .. points .. " }"] = "rapid.node: name = 5; it must be a string",
      ["{ name = 'odd', " .. points .. " }"] = 'rapid.node "odd": the documentation is missing; add doc = "..."',
      ["{ name = 'odd', doc = 'x' }"] = roles,
      ["{ name = 'odd', doc = 'x', points = 5 }"] = roles,
      ["{ name = 'odd', doc = 'x', pionts = function(p) end, " .. points .. " }"] =
        'rapid.node "odd": unknown field "pionts"; did you mean "points"?',
      ["{ name = 'odd', doc = 'x', params = 5, " .. points .. " }"] =
        'rapid.node "odd": params must be a table of declarations by name',
      ["{ name = 'odd', doc = 'x', params = { a = 5 }, " .. points .. " }"] =
        'rapid.node "odd", parameter a: the declaration must look like { "float", default = 1, doc = "..." }',
      ["{ name = 'odd', doc = 'x', params = { a = { 'flaot', default = 1, doc = 'x' } }, " .. points .. " }"] =
        'rapid.node "odd", parameter a: unknown type "flaot"; did you mean "float"?',
      ["{ name = 'odd', doc = 'x', params = { a = { 'float', doc = 'x' } }, " .. points .. " }"] =
        'rapid.node "odd", parameter a: the default is missing; add default = ..., or required = true',
      ["{ name = 'odd', doc = 'x', params = { a = { 'float', default = 1 } }, " .. points .. " }"] =
        'rapid.node "odd", parameter a: the documentation is missing; add doc = "..."',
      ["{ name = 'odd', doc = 'x', params = { a = { 'float', default = 'x', doc = 'x' } }, " .. points .. " }"] =
        'rapid.node "odd", parameter a: the default a = "x" has the wrong type; it must be a number',
      ["{ name = 'odd', doc = 'x', params = { a = { 'float', default = 3, max = 2, doc = 'x' } }, " .. points .. " }"] =
        'rapid.node "odd", parameter a: the default a = 3 is out of range; it must be at most 2',
      ["{ name = 'odd', doc = 'x', params = { a = { 'float', defualt = 3, doc = 'x' } }, " .. points .. " }"] =
        'rapid.node "odd", parameter a: unknown field "defualt"; did you mean "default"?',
      ["{ name = 'gravity', doc = 'x', " .. points .. " }"] =
        'a node "gravity" exists already; give the new one another name',
    } do
      scene.folder:write("odd.lua", before .. "return rapid.node " .. (definition == "5" and "(5)" or definition))
      assert.equal("odd.lua:2: " .. expected, scene.error("return rapid.create {} :odd {}"), definition)
    end
  end)

  it("may be defined in the graph itself", function()
    local result = scene.run [[
rapid.node { name = "rise_here", doc = "Rises.", points = function(p) p.P = p.P + vec3(0, 1, 0) end }
return rapid.create { points = two } :rise_here {} :solve {}]]
    assert.near({0, 3, 0}, result[3][1].P, 1e-6)
  end)

  it("that is not there is an unknown node, with the nearest name", function()
    scene.folder:write("push.lua", push)
    assert.equal('scene.lua:1: unknown node "gravty"; did you mean "gravity"?',
      scene.error "return rapid.create {} :gravty {}")
    assert.equal('scene.lua:1: unknown node "liftt"; did you mean "lift"?',
      scene.error "return rapid.create {} :liftt {}")
    assert.equal('scene.lua:1: unknown node "zzz"; `rapid nodes` lists all nodes',
      scene.error "return rapid.create {} :zzz {}")
  end)
end)
