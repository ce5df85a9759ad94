-- Parameters of Lua nodes: the values that each type accepts, passes to the kernel and refuses; attributes that a node
-- creates, and names held by parameters.
local scene = require "testing.scene"

-- Writes the node `mine` next to the scenes. params, kernel: text.
local function define(params, kernel, more)
  scene.folder:write("mine.lua", ([[
local rapid = require "rapid"
return rapid.node { name = "mine", doc = "A test.", params = { %s }, %s
  points = function(p, frame, params)
    %s
  end }]]):format(params, more or "", kernel))
end

local function run(arguments, columns, frames)
  return scene.run(([[
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}}, %s } } :mine { %s } :solve {}]])
    :format(columns or "", arguments), { frames = {1, frames or 2} })
end

local function fault(arguments, columns)
  local ok, message = pcall(run, arguments, columns)
  assert.is_false(ok, "the scene ran")
  return (message:gsub(scene.folder.path:gsub("%W", "%%%0") .. "/", ""))
end

describe("a parameter of a node in Lua", function()
  it("may be a list", function()
    define([[a = { "floats", default = {1, 2}, min = 0, doc = "x" },
      b = { "vec3s", default = {{0, 0, 1}}, doc = "x" }]],
      "p.P = params.b[#params.b] * params.a[1] + vec3(#params.a, #params.b, 0)")
    assert.near({2, 1, 1}, run("")[2][1].P, 0)
    assert.near({1, 2, 5}, run("a = {5}, b = {{9, 9, 9}, {0, 0, 1}}")[2][1].P, 0)
    assert.equal('scene.lua:1: node "mine1": a = -3 is out of range; it must be at least 0', fault "a = {1, -3}")
    assert.truthy(fault("b = {1, 2}"):find("b = 1", 1, true))
  end)

  it("may be a ramp, which the kernel calls", function()
    define([[r = { "ramp", default = {{0, 0}, {1, 10}, {3, 20}}, doc = "x" }]],
      "p.P = vec3(params.r(p.a), params.r(-1), params.r(99))")
    for x, expected in pairs { [0] = 0, [0.25] = 2.5, [1] = 10, [2] = 15, [3] = 20 } do
      assert.near({expected, 0, 20}, run("", ("a = {%g, 0}"):format(x))[2][1].P, 1e-6)
    end
    define([[r = { "ramp", required = true, doc = "x" }]], "p.P = params.r(p.a)")
    assert.near({2, 0, 3}, run("r = {{0, {0, 0, 4}}, {2, {4, 0, 2}}}", "a = {1, 0}")[2][1].P, 1e-6)
    assert.near({7, 8, 9}, run("r = {{5, {7, 8, 9}}}", "a = {1, 0}")[2][1].P, 1e-6)
    local remedy = "; it must be a list of keys with increasing positions and values of one type, such as { {0, " ..
      "1}, {0.5, 4} } or { {0, {1, 0, 0}} }"
    for given, expected in pairs {
      ["3"] = "r = 3", ["{}"] = "r = {}", ["{{1, 2}, {1, 3}}"] = "r has the position 1 after 1",
      ["{{0, 1}, {1, {1, 1, 1}}}"] = "r has both numbers and vec3s as values", ["{{0}}"] = "r has the key {0}",
    } do
      assert.equal('scene.lua:1: node "mine1": ' .. expected .. remedy, fault("r = " .. given))
    end
  end)

  it("may be a shape, also one of the frame", function()
    define([[s = { "shape", required = true, doc = "x" }]], "p.a = params.s:distance(p.P)")
    local points = run("s = function(f) return rapid.shape.sphere { radius = f.number } end", "a = {0, 0}", 3)
    assert.near(1 - 3, points[3][1].a, 1e-6)
    assert.truthy(fault("s = 3", "a = {0, 0}"):find('node "mine1": s = 3', 1, true))
  end)

  it("may name attributes that the kernel reads and writes", function()
    define([[from = { "read", default = "P", doc = "x" }, to = { "write", default = "v", doc = "x" }]],
      "p[params.to] = p[params.from]")
    local points = run("from = 'heat', to = 'cold'", "heat = {3, 4}, cold = {0, 0}")
    assert.equal(4, points[2][2].cold)
    assert.near({1, 1, 0}, run("")[2][2].v, 0)
    assert.equal('scene.lua:1: node "mine1": no attribute "haet"; did you mean "heat"? ' ..
      "(or add :attribute{ haet = 0 } before it)", fault("from = 'haet'", "heat = {0, 0}"))
    assert.equal('scene.lua:1: node "mine1": to = "id": this attribute is read-only', fault "to = 'id'")
    assert.equal('scene.lua:1: node "mine1": from = ""; it must be the name of an attribute', fault "from = ''")
    assert.truthy(fault("to = function() return 'v' end"):find("to can't be a function of the frame", 1, true))
    assert.truthy(fault("to = 'heat'", "heat = {0, 0}"):find('attribute "heat" takes a number, not vec3(0, 1, 0)', 1,
      true))
  end)

  it("may name a group that the kernel changes", function()
    define([[into = { "group", required = true, doc = "x" }]],
      "if p.id == 1 then p:join(params.into) else p:leave(params.into) end")
    local points = run("into = 'hot'")[2]
    assert.same({ "hot" }, points:groups())
    assert.equal(1, points:group("hot")[1].id)
    assert.equal(1, #points:group "hot")
    assert.truthy(fault(""):find('node "mine1": into is missing: x', 1, true))
    define([[into = { "group", default = "hot", doc = "x" }]], "p:join(params.into .. p.id)")
    assert.truthy(fault(""):find('can\'t join the group "hot0"', 1, true), fault "")
  end)

  it("has a type that there is, and no bounds where they mean nothing", function()
    define([[a = { "vec4", default = 0, doc = "x" }]], "")
    assert.truthy(fault(""):find('unknown type "vec4"; did you mean "vec3"?', 1, true), fault "")
    define([[a = { "bool", default = true, min = 0, doc = "x" }]], "")
    assert.truthy(fault(""):find("a bool has no min and max", 1, true), fault "")
    define([[a = { "float", default = math.huge, doc = "x" }]], "")
    assert.truthy(fault(""):find("the default a = inf is out of range", 1, true), fault "")
    define([[a = { "float", default = math.huge, max = math.huge, doc = "x" }]], "p.P = vec3(1 / params.a, 0, 0)")
    assert.near({0, 0, 0}, run("")[2][2].P, 0)
  end)
end)

describe("a node in Lua that makes attributes", function()
  it("makes them with their value, before and after Solve", function()
    define("", "p.Cd = p.Cd * 0.5", "makes = { Cd = {1, 1, 0.5}, turn = {0, 0, 0, 1} },")
    local result = run("", nil, 3)
    assert.near({1, 1, 0.5}, result[1][1].Cd, 0)
    assert.near({0.25, 0.25, 0.125}, result[3][1].Cd, 0)
    assert.equal(1, result[3][1].turn.w)
    local behind = scene.run("return rapid.create { points = two } :solve {} :mine {}", { frames = {1, 3} })
    assert.near({0.5, 0.5, 0.25}, behind[3][1].Cd, 0)
  end)

  it("refuses a value that is no attribute", function()
    define("", "", "makes = 3,")
    assert.truthy(fault(""):find('rapid.node "mine": makes = 3', 1, true), fault "")
    define("", "", "maeks = {},")
    assert.truthy(fault(""):find('unknown field "maeks"; did you mean "makes"?', 1, true), fault "")
  end)
end)

describe("a file beside the scene with the name of a node", function()
  it("that is a scene is told apart", function()
    scene.folder:write("hider.lua", 'return require "rapid".create {} :hider {}')
    assert.equal('scene.lua:1: hider.lua uses the node "hider" instead of defining it; rename the file, because it ' ..
      "hides the node", scene.error("return rapid.create {} :hider {}"):gsub("^hider%.lua:1: ", "scene.lua:1: "))
  end)
end)
