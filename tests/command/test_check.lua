-- rapid check: errors that can be found without a frame. They are those of `run` (test_run_failures.lua).
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
      "scene.lua: OK, 5 of 6 nodes reached from output main\n", result.stdout)
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

  it("fails by no kernel: what is wrong in a frame is for the run to tell", function()
    local result = check [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }
  :points("fails", function(p) error "run" end) :solve {}
]]
    assert.equal(0, result.status, result.stderr)
  end)

  it("warns of what is doubtful, and goes on", function()
    local result = check [[
local rapid = require "rapid"
local points = rapid.create {} :solve {}
points:write { file = "never.####.csv" }
return points
]]
    assert.equal(0, result.status)
    assert.equal('warning: scene.lua:3: node "write1": writes nothing: no output comes from it; ' ..
      "return it, or go on from it\n", result.stderr)
  end)

  it("finds a :write that puts several frames into one file", function()
    local result = check [[return require("rapid").create {} :solve {} :write { file = "a.csv" }]]
    assert.equal(2, result.status)
    assert.equal('scene.lua:1: node "write1": file = "a.csv": several frames go to one file; ' ..
      "put the frame's number into its name, as ####\n", result.stderr)
  end)
end)
