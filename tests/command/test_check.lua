-- rapid check: errors that can be found without computing a frame. test_run_failures.lua has the same errors for `run`.
local command = require "testing.command"

local function check(text, arguments)
  local folder = command.folder()
  folder:write("scene.lua", text)
  return command.rapid("check scene.lua " .. (arguments or ""), { cwd = folder.path }), folder
end

local scene = [[
local rapid = require "rapid"
local rate = rapid.param("rate", 100, "points born per second")
local spare = rapid.create {}
return rapid.create {}
  :emit { source = rapid.mesh.sphere { radius = 1 }, rate = rate } :gravity {} :solve {}
  :write { file = "made.####.csv" }
]]

describe("rapid check", function()
  it("counts what is right, shows the parameters, and writes nothing", function()
    local result, folder = check(scene)
    assert.equal(0, result.status, result.stderr)
    assert.equal("param rate = 100  points born per second\n" ..
      "scene.lua: OK, 5 of 6 nodes lead to output main\n", result.stdout)
    assert.equal("", result.stderr)
    assert.same({ "scene.lua" }, folder:list())
  end)

  it("shows what --set makes of a parameter", function()
    local result = check(scene, "--set rate=5")
    assert.equal(0, result.status)
    assert.truthy(result.stdout:find("param rate = 5 (default 100)  points born per second\n", 1, true), result.stdout)
  end)

  it("checks the outputs of a run as well", function()
    local result = check(scene, "-o a.####.csv:haet")
    assert.equal(2, result.status)
    assert.equal('-o a.####.csv:haet: no attribute or group "haet" to write\n', result.stderr)
    assert.equal(2, check(scene, "-o a.####.doc").status)
    assert.equal(0, check(scene, "-o a.####.csv:age").status)
  end)

  it("finds what kernels do wrong with a few points of the first frame", function()
    local chain = [[
local rapid = require "rapid"
local x = 1
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
  :emit { source = rapid.mesh.sphere {}, rate = 1e6, %s }
  :points("k", function(p) %s end)
  :action("a", function(p) %s end)
  :group { name = "g", where = function(p) %s end }
  :detail("d", function(points) %s end)
  :solve {}
]]
    local right = { "", "", "", "return p.id > 3", "" }
    local function with(k, text)
      local parts = { unpack(right) }
      parts[k] = text
      return check(chain:format(unpack(parts)))
    end
    assert.equal(0, with(2, "p.v = p.v * x").status)
    for k, wrong in ipairs { "birth = function(p) p.v = p.P.x.y end", "p.v = p.v + x", "p.v = p.id",
                                "return p.id + p.P > 3" } do
      local result = with(k, wrong)
      assert.not_equal(0, result.status, wrong)
      assert.truthy(result.stderr:find(("^scene.lua:%d: node"):format(3 + k)), result.stderr)
    end
    -- The scene may require more points than this trial has.
    assert.equal(0, with(5, "points[5000].P = vec3(0, 0, 0)").status)
  end)

  it("finds what kernels do wrong with points that are born later, or at events", function()
    local chain = [[
local rapid = require "rapid"
local parents = rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 1000 }
  :collide { shape = rapid.shape.plane { offset = -9 } } :solve {}
return rapid.create {} :%s }
  :points("k", function(p, frame) %s end)
  :solve {}
]]
    local function births(source)
      return (source:find "^parents" and "spawn { from = " or "emit { source = ") .. source
    end
    for _, source in ipairs {
      "rapid.mesh.sphere {}, rate = 5", "rapid.mesh.sphere {}, impulse = { [30] = 5 }",
      "rapid.mesh.sphere {}, rate = function(frame) return frame.number > 10 and 100 or 0 end",
      "rapid.mesh.sphere {}, count = function(frame) return frame.number > 40 and 1 or 0 end",
      "function(frame) return rapid.points.from { P = frame.number > 8 and {{0, 1, 0}} or {} } end, rate = 99",
      'parents, on = "hit"', 'parents, on = "death", split = true', 'parents, on = "age > 0.5", kill_parent = true',
      "parents, on = function(p) return p.P.y < -5 end", "parents, rate = 0.02",
    } do
      local result = check(chain:format(births(source), "p.v = p.P.x.y"))
      assert.not_equal(0, result.status, source)
      assert.match('^scene.lua:5: node "k"', result.stderr)
      assert.equal("", check(chain:format(births(source), "p.v = p.P * frame.time")).stderr)
    end
    -- A trial uses the frames that contain points.
    assert.equal(0, check(chain:format(
      births "rapid.mesh.sphere {}, rate = function(frame) return frame.number > 10 and 100 or 0 end",
      "p.v = p.P * ({ [17] = 2 })[frame.number]")).status)
    for _, source in ipairs { "rapid.mesh.sphere {}, rate = 0", "parents, rate = 0",
                              'parents, on = "hit", count = 0' } do
      assert.equal(0, check(chain:format(births(source), "p.v = p.P.x.y")).status, source)
    end
  end)

  it("warns of doubtful values, and continues", function()
    local result = check [[
local rapid = require "rapid"
local points = rapid.create {} :solve {}
points:write { file = "never.####.csv" }
return points
]]
    assert.equal(0, result.status)
    assert.equal('warning: scene.lua:3: node "write1": writes nothing, because it leads to no output; ' ..
      "return it, or continue the chain from it\n", result.stderr)
  end)

  it("finds a :write that puts several frames into one file", function()
    local result = check [[return require("rapid").create {} :solve {} :write { file = "a.csv" }]]
    assert.equal(2, result.status)
    assert.equal('scene.lua:1: node "write1": file = "a.csv": several frames would go into one ' ..
      "file; put #### into the name for the frame number\n", result.stderr)
  end)
end)
