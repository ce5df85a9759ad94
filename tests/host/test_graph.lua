-- The graph language: nodes as values, names, groups, several outputs, feedback, and the order of events.
local scene = require "testing.scene"

local function values(points, name)
  local list = {}
  for i = 1, #points do list[i] = points[i][name] end
  return list
end

describe("a graph", function()
  it("returns its node, or nodes by name", function()
    local result = scene.run [[
local chain = rapid.create { points = two } :solve {}
return { left = chain:delete { where = function(p) return p.id == 1 end },
         right = chain:delete { where = function(p) return p.id == 0 end } }]]
    assert.same({ "left", "right" }, result.outputs)
    assert.same({ 0 }, values(result:output "left"[2], "id"))
    assert.same({ 1 }, values(result:output "right"[2], "id"))
  end)

  it("is refused where it returns anything else", function()
    for text, expected in pairs {
      ["rapid.create {}"] = "scene.lua: the graph returns no output; end the file with `return` and a node",
      ["return nil"] = "scene.lua: the graph returns no output; end the file with `return` and a node",
      ["return {}"] = "scene.lua: the graph returns no output; end the file with `return` and a node",
      ["return 3"] = "scene.lua: the graph returns 3; it must return a node, or a table of nodes by name",
      ["return two"] = "scene.lua: the graph returns points; it must return a node, or a table of nodes by name",
      ["return { rapid.create {} }"] = "scene.lua: the graph returns a table that contains other things than nodes " ..
        "by name; return { main = node, ... }",
      ["return { main = 3 }"] = "scene.lua: the graph returns a table that contains other things than nodes by " ..
        "name; return { main = node, ... }",
      ["return rapid.create"] = "scene.lua: the graph returns a function; it must return a node, or a table of " ..
        "nodes by name",
    } do
      assert.equal(expected, scene.error(text), text)
    end
  end)

  it("uses a node as input more than once", function()
    local result = scene.run [[
local start = rapid.create { points = two } :points("k", function(p) p.P = p.P + vec3(0, 1, 0) end)
return { a = start, b = start:points("more", function(p) p.P = p.P + vec3(0, 10, 0) end) }]]
    assert.near({0, 2, 0}, result:output "a"[1][1].P, 0)
    assert.near({0, 12, 0}, result:output "b"[1][1].P, 0)
  end)

  it("reports a syntax error with its line", function()
    assert.equal("scene.lua:2: unexpected symbol near '}'", scene.error "local x = 1\nreturn rapid.create { fps = }")
    assert.equal("scene.lua:3: 'end' expected (to close 'function' at line 1) near '<eof>'",
      scene.error "local f = function()\n  return 1\n")
  end)

  it("says what goes wrong in its body, with the line of the call", function()
    for text, expected in pairs {
      ["\n\nerror 'no wind'"] = "scene.lua:3: no wind",
      ["\nerror('no wind', 0)"] = "scene.lua:2: no wind",
      ["\nerror {}"] = "scene.lua:2: the script raised an error with a table instead of a message",
      ["error()"] = "scene.lua:1: the script raised an error without a message",
      ["error(42)"] = "scene.lua:1: 42",
      ["\nlocal x = nil + 1"] = "scene.lua:2: attempt to perform arithmetic on a nil value",
      ["\nwnid.push()"] = "scene.lua:2: attempt to index global 'wnid' (a nil value)",
      ["assert(false)"] = "scene.lua:1: assertion failed!",
      ["assert(nil, 'no assets')"] = "scene.lua:1: no assets",
    } do
      local message = scene.error(text)
      assert.equal(expected, message:sub(1, #expected), text)
      assert.falsy(message:find "traceback")
    end
  end)

  it("says that a function calls itself without end, with a line where the language has one left to tell", function()
    assert.truthy(scene.error("local function f() return f() + 1 end\nf()"):match(
      "^scene%.lua:?%d*: stack overflow: a function calls itself endlessly"))
  end)

  it("names the line of the last call too, which leaves no frame behind", function()
    assert.equal('scene.lua:3: node "solve1": substeps = 0 is out of range; it must be from 1 to 1048576',
      scene.error "return rapid.create {}\n  :gravity {}\n  :solve { substeps = 0 }")
    assert.equal('scene.lua:2: unknown node "sovle"; did you mean "solve"?',
      scene.error "return rapid.create {}\n  :sovle {}")
  end)
end)

describe("a node", function()
  it("is named by its type and number, or by `name`", function()
    assert.equal('scene.lua:1: node "gravity2": unknown parameter "x"; gravity has group, g',
      scene.error "return rapid.create {} :gravity {} :gravity { x = 1 }")
    assert.equal('scene.lua:1: node "down": unknown parameter "x"; gravity has group, g',
      scene.error "return rapid.create {} :gravity { name = 'down', x = 1 }")
    assert.equal('scene.lua:1: node "gravity1": name = 5; it must be a string',
      scene.error "return rapid.create {} :gravity { name = 5 }")
  end)

  it("shares its name with no other", function()
    assert.equal('scene.lua:3: node "wind": the node at line 2 has the same name; give each node a different name',
      scene.error [[
return rapid.create { points = two }
  :wind { name = "wind" }
  :wind { name = "wind" } :solve {}]])
  end)

  it("has a number after its name if it is a kernel whose name is taken", function()
    local text = [[
local function chain(x, add)
  return rapid.create { points = rapid.points.from { P = {{x, 0, 0}} } } :attribute { heat = 0 }
    :points("heat", function(p) p.heat = p.heat + add + p:rand(1) end) :solve {}
end
return { a = chain(0, 10), b = chain(1, 20), c = chain(2, 30) }]]
    local result = scene.run(text, { frames = {2, 2} })
    local rand = {}
    for name, add in pairs { a = 10, b = 20, c = 30 } do rand[name] = result:output(name)[2][1].heat - add end
    assert.truthy(rand.a > 0 and rand.a < 1 and rand.a ~= rand.b and rand.b ~= rand.c) -- keyed by the node's name
    local only = scene.run(text, { frames = {2, 2}, set = { ["heat2.group"] = "" } })
    assert.equal(result:output "b"[2][1].heat, only:output "b"[2][1].heat)
    assert.truthy(scene.error(text, { set = { ["heat4.group"] = "" } }):find('no node "heat4"', 1, true))
  end)

  it("keeps the name of a kernel if the other one of that name leads to no output", function()
    local text = [[
local c = rapid.create { points = two } :attribute { heat = 0 }
local a = c:points("heat", function(p) p.heat = 1 end) :solve {}
local b = c:points("heat", function(p) p.heat = p:rand(1) end) :solve {}
return %s]]
    local alone = scene.run(text:gsub("local a[^\n]*", ""):format "b", { frames = {2, 2} })
    assert.same_points(alone[2], scene.run(text:format "b", { frames = {2, 2} })[2])
  end)

  it("takes a table of named parameters alone", function()
    for text, expected in pairs {
      ["rapid.create {} :gravity(5)"] = ":gravity needs a table of parameters: :gravity{ ... }",
      ["rapid.create(24)"] = ":create needs a table of parameters: :create{ ... }",
      ["rapid.create {} :gravity { 0, -9.81, 0 }"] = 'node "gravity1": 0 has no name; write ' ..
        "{ NAME = value, ... }; a vector is {x, y, z}, and a number has no comma",
      ["rapid.create {} :gravity { { 0, 1, 0 } }"] = 'node "gravity1": {0, 1, 0} has no name; ' ..
        "write { NAME = value, ... }",
      ["rapid.create {} :gravity({}, {})"] = ":gravity takes only one table of parameters",
      ["rapid.create {} :points('k')"] = ":points needs a name and a function, or a table { name = ..., kernel = ... }",
      ["rapid.create {} :points(function() end)"] = ":points needs a name and a function, or a table { name = ..., " ..
        "kernel = ... }",
      ["rapid.create {} :points { name = 'k' }"] =
        'node "k": kernel is missing: function of a point, function(p, frame) (a name without a value counts as ' ..
        "missing)",
      ["rapid.create {} :points { name = 'k', kernel = 3 }"] = 'node "k": kernel = 3 has the wrong type; ' ..
        "it must be a function of a point",
      ["rapid.create {} :merge()"] = ":merge needs another node: a:merge(b)",
      ["rapid.create {} :merge(3)"] = 'node "merge1": input 2 is 3; it must be a node: write node:merge{ ... }',
      ["rapid.create {} .gravity {}"] = 'node "gravity1": input 1 is {}; it must be a node: write ' ..
        "node:gravity{ ... }",
      ["rapid.create { fps = '24' }"] = 'node "create1": fps = "24" has the wrong type; it must be a number',
      ["rapid.create { fps = 0 }"] = 'node "create1": fps = 0 is out of range; it must be above 0',
      ["rapid.create { fps = function() return 24 end }"] = 'node "create1": fps can\'t be a function of the frame; ' ..
        "it must be a constant",
      ["rapid.craete {}"] = 'rapid has no "craete"; did you mean "create"?',
      ["rapid.mesh.shpere {}"] = 'rapid.mesh has no "shpere"; did you mean "sphere"?',
      ["two:gravity {}"] = 'points have no "gravity"',
    } do
      assert.equal("scene.lua:1: " .. expected, scene.error("return " .. text), text)
    end
  end)

  it("acts on its group alone", function()
    local result = scene.run [[
return rapid.create { points = two }
  :group { name = "right", where = function(p) return p.P.x > 0.5 end }
  :gravity { g = {0, -24, 0}, group = "right" } :solve {}]]
    assert.near({0, 0, 0}, result[2][1].v, 0)
    assert.near({0, -1, 0}, result[2][2].v, 1e-6)
  end)

  it("asks for a group that some node makes", function()
    assert.equal('scene.lua:1: node "gravity1": no node makes a group "rihgt"; did you mean "right"?', scene.error [[
return rapid.create {} :group { name = "right" } :gravity { group = "rihgt" } :solve {}]])
    assert.equal('scene.lua:1: node "gravity1": no node makes a group "hot"', scene.error [[
return rapid.create {} :gravity { group = "hot" } :solve {}]])
  end)

  it("takes its per-point parameters from an attribute", function()
    -- Both fall from 0.1 m and bounce: with bounce 0 one stays, with bounce 1 the other is back at its apex.
    local result = scene.run([[
local points = rapid.points.from { P = {{0, 0.1, 0}, {1, 0.1, 0}}, springy = {0, 1} }
return rapid.create { points = points, fps = 100 } :gravity { g = {0, -20, 0} }
  :collide { shape = rapid.shape.plane {}, bounce = rapid.attr "springy" } :solve {}]], { frames = {21, 21} })
    assert.near(0, result[21][1].P.y, 1e-6)
    assert.near(0.1, result[21][2].P.y, 1e-6)
    assert.equal('scene.lua:2: node "collide1": no attribute "wobble"; add :attribute{ wobble = 0 } before it',
      scene.error [[
local shape = rapid.shape.plane {}
return rapid.create { points = two } :collide { shape = shape, bounce = rapid.attr "wobble" } :solve {}]])
    assert.equal('scene.lua:1: rapid.attr needs the name of an attribute: rapid.attr "bounce"',
      scene.error "return rapid.create { fps = rapid.attr(3) }")
    assert.truthy(scene.error([[return rapid.create { fps = rapid.attr "heat" }]])
      :find('node "create1": fps = rapid.attr "heat" has the wrong type', 1, true))
  end)
end)

describe("a parameter that is a function of the frame", function()
  it("is called in each frame, at its time, and interpolated between frames", function()
    local result = scene.run([[
return rapid.create { points = two, fps = 10 }
  :gravity { g = function(frame) return vec3(frame.number, frame.time, frame.dt) end } :solve {}]], { frames = {1, 4} })
    -- v = sum over the frames 2 to 4 of g dt, with g at the midpoint of each
    assert.near({0.1 * (1.5 + 2.5 + 3.5), 0.1 * (0.05 + 0.15 + 0.25), 3 * 0.01}, result[4][1].v, 1e-6)
  end)

  it("decides how many are born", function()
    local result = scene.run([[
return rapid.create {} :emit { source = two, count = function(frame) return frame.number end } :solve {}]],
      { frames = {1, 4} })
    assert.equal(0, #result[1])
    assert.equal(2, #result[2])
    assert.equal(9, #result[4])
  end)

  it("is reported with node, file, line and frame when it fails", function()
    for body, expected in pairs {
      ["return nil"] = 'scene.lua:1: node "emit1": count is nil; it must be an integer',
      ["return 'many'"] =
        'scene.lua:1: node "emit1": count = "many" has the wrong type; it must be an integer',
      ["return -1"] = 'scene.lua:1: node "emit1": count = -1 is out of range; it must be at least 0',
      ["return nil + 1"] = 'scene.lua:3: node "emit1": attempt to perform arithmetic on a nil value',
      ["error 'no more'"] = 'scene.lua:3: node "emit1": no more',
      ["return function() end"] = 'scene.lua:1: node "emit1": count is a function that returned a function; it ' ..
        'must return a value',
    } do
      local message = scene.error(([[
local source = { source = two, count = function(frame)
  if frame.number < 3 then return 1 end
  %s
end }
return rapid.create {} :emit(source) :solve {}]]):format(body))
      expected = expected:gsub("^scene.lua:1", "scene.lua:5")
      assert.equal(expected .. " (frame 3)", message)
    end
  end)

  it("is called before the first frame, as by rapid check", function()
    local result = scene.command("check",
      "return rapid.create {} :emit { source = two, count = function() return -1 end }")
    assert.equal('scene.lua:1: node "emit1": count = -1 is out of range; it must be at least 0 (frame 1)\n',
      result.stderr)
    assert.equal(2, result.status)
  end)
end)

describe("at the frame start", function()
  it("Create alone yields points, and nodes after Solve run", function()
    local result = scene.run [[
return rapid.create { points = two } :points("before", function(p) p.v = vec3(0, 24, 0) end) :solve {}
  :points("after", function(p) p.P = p.P + vec3(100, 0, 0) end)]]
    assert.near({0, 0, 0}, result[1][1].v, 0)
    assert.near({100, 1, 0}, result[1][1].P, 0)
    assert.near({100, 2, 0}, result[2][1].P, 1e-5)
  end)

  it("all columns and groups exist, with their defaults", function()
    local result = scene.run [[
return rapid.create { points = two } :emit { source = two, count = 1, attributes = { Cd = {1, 0, 0} } }
  :attribute { heat = 3 } :points("k", function(p) p.spin = p.age p:join "seen" end) :attribute { spin = 2 } :solve {}]]
    for frame, points in result:frames() do
      assert.same(result[3]:names(), points:names(), "frame " .. frame)
      assert.same(result[3]:groups(), points:groups())
    end
    assert.equal(3, result[1][1].heat)
    assert.equal(2, result[1][1].spin)
    assert.equal(0, #result[1]:group "seen")
    assert.equal(3, #result[2]:group "seen")
  end)

  it("impulse[start] gives points of age 0 that have not moved", function()
    local result = scene.run([[
return rapid.create { start = 11 } :attribute { at = -1 }
  :emit { source = two, impulse = { [11] = 5, [13] = 1 }, velocity = {0, 24, 0}, from = "points", birth = "begin" }
  :points("k", function(p) p.at = p.age end) :solve {}]], { frames = {11, 13} })
    assert.equal(5, #result[11])
    for i = 1, 5 do
      assert.equal(1, result[11][i].P.y)
      assert.near({0, 24, 0}, result[11][i].v, 0)
      assert.equal(-1, result[11][i].at)
    end
    assert.equal(5, #result[12])
    assert.near(2, result[12][1].P.y, 1e-6)
    assert.equal(6, #result[13])
  end)

  it("is frame 1, or `start`; no frame is before it", function()
    assert.equal("frames: 1 is before the scene's first frame, 5",
      scene.error "return rapid.create { start = 5, points = two }")
    assert.equal(2, #scene.run("return rapid.create { start = -3, points = two } :solve {}", { frames = {-3, -1} })[-3])
  end)
end)

describe("Solve", function()
  it("feeds its points back to Create, without the changes of later nodes", function()
    local result = scene.run [[
return rapid.create { points = two } :attribute { heat = 0 }
  :points("in", function(p) p.heat = p.heat + 1 end) :solve {}
  :points("out", function(p) p.heat = p.heat + 100 end)]]
    assert.equal(100, result[1][1].heat)
    assert.equal(101, result[2][1].heat)
    assert.equal(102, result[3][1].heat)
  end)

  it("is not needed: a chain without it yields the initial points at each frame", function()
    local result = scene.run [[
return rapid.create { points = two } :points("k", function(p, frame) p.P = p.P + vec3(frame.number, 0, 0) end)]]
    assert.near({3, 1, 0}, result[3][1].P, 0)
  end)

  it("may be used once per chain", function()
    assert.equal('scene.lua:2: node "solve2": a second solve after "create1": "solve1" at line 1 is already its ' ..
      "solve; a create can have only one",
      scene.error "local once = rapid.create { points = two } :solve {}\nreturn once:solve {}")
    assert.equal('scene.lua:2: node "right": a second solve after "create1": "left" at line 2 is already its ' ..
      "solve; a create can have only one", scene.error [[
local start = rapid.create {}
return { a = start:solve { name = 'left' }, b = start:solve { name = 'right' } }]])
  end)

  it("feeds back several simulations of a graph, each with its own ids", function()
    local result = scene.run [[
local function rising(speed)
  return rapid.create { points = two, name = "create" .. speed }
    :points("lift" .. speed, function(p) p.v = vec3(0, speed, 0) end) :solve {}
end
return { slow = rising(24), fast = rising(240) }]]
    assert.near({0, 3, 0}, result:output "slow"[3]:by_id(0).P, 1e-5)
    assert.near({1, 21, 0}, result:output "fast"[3]:by_id(1).P, 1e-5)
  end)
end)

describe(":merge", function()
  it("takes a point that comes by both inputs once, from the first", function()
    local result = scene.run [[
local start = rapid.create { points = two } :attribute { heat = 0 }
local a = start:points("a", function(p) p.heat = 1 end) :delete { where = function(p) return p.id == 1 end }
return a:merge(start:points("b", function(p) p.heat = 2 end))]]
    assert.same({ 0, 1 }, values(result[1], "id"))
    assert.same({ 1, 2 }, values(result[1], "heat"))
  end)

  it("gives points of another origin new ids, which they keep", function()
    local result = scene.run [[
local other = rapid.create { name = "other", points = two }
  :points("push", function(p) p.v = vec3(24, 0, 0) end) :solve {}
return rapid.create { name = "one", points = two } :solve {} :merge(other)]]
    for frame, points in result:frames() do
      assert.same({ 0, 1, 2, 3 }, values(points, "id"))
      assert.near({frame - 1, 1, 0}, points:by_id(2).P, 1e-5)
    end
  end)

  it("takes more than two, and a name", function()
    assert.equal(6, #scene.run([[
local function start(name) return rapid.create { name = name, points = two } end
return start "a":merge(start "b", start "c", { name = "all" })]])[1])
  end)
end)

describe("a scene of little", function()
  it("runs without points, with a rate of 0, and for one frame", function()
    for _, text in ipairs {
      "return rapid.create {}",
      "return rapid.create {} :solve {}",
      "return rapid.create { points = rapid.points.from { P = {} } } :gravity {} :solve {}",
      "return rapid.create {} :emit { source = two, rate = 0 } :gravity {} :solve {}",
      "return rapid.create {} :emit { source = two, count = 0 } :points('k', function(p) p.v = p.v * p.dt end)",
      "return rapid.create {} :points('k', function(p) p:kill() end) :delete { where = function() return true end }",
    } do
      for frame, points in scene.run(text, { frames = {1, 3} }):frames() do
        assert.equal(0, #points, text .. " " .. frame)
      end
      assert.equal(0, #scene.run(text, { frames = {1, 1} })[1])
    end
  end)
end)

describe("a scene of many nodes", function()
  it("runs a chain of 100 kernels in order", function()
    local result = scene.run([[
local chain = rapid.create { points = two } :attribute { n = 0 }
for k = 1, 100 do
  chain = chain:points("k" .. k, function(p)
    if p.n ~= (k - 1) % 10 then error("out of order") end
    p.n = k % 10
  end)
end
return chain:points("add", function(p, frame) p.P = p.P + vec3(0, 0, 1) end) :solve {}]], { frames = {1, 4} })
    assert.near({1, 1, 3}, result[4][2].P, 0)
    assert.equal(0, result[4][2].n)
  end)
end)
