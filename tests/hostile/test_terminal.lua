-- Strings in scenes, files and tests contain terminal commands; Rapid's output contains none.
local command = require "testing.command"

local clear = "\27[2J"

local scene = [[
local rapid = require "rapid"
local n = rapid.param("n", 3, "the \27[2J number")
print("of the scene: \27[2J", "\194\155", "\r")
local ball = rapid.levelset.sphere { voxel = 0.2 }
return rapid.create { name = "create\27[2J", points = rapid.points.from { P = {{0, 1, 0}}, w = {{0, 0, 1}} } }
  :attribute { name = "attribute\27[2J", heat = 1 }
  :points("kernel\27[2J", function(p) p.heat = 2 * p.heat p:join "group\27[2J" end)
  :action("action\27[2J", function(p) p.force = p.force - 1e6 * p.P end)
  :drag { name = "drag\255\27[2J", linear = 1e5 }
  :collide { name = "collide\27[2J", shape = ball, friction = function() return 0.1 end }
  :contact { name = "contact\27[2J", radius = 0.1, friction = function() return 0.1 end }
  :solve { name = "solve\27[2J" }
]]

local study = [[
local rapid = require "rapid"
return rapid.study { name = "study\27[2J", sweep = { ["knob\27[2J"] = {1, 2} }, frames = {1, 2},
  reference = { ["knob\27[2J"] = 4 }, error = "rms", error_frames = "last",
  scene = function(knobs)
    return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } } :attract {}
      :solve { substeps = knobs["knob\27[2J"] }
  end }
]]

local tests = [[
describe("group\27[2J", function()
  it("fails\27[2J", function() assert.equal("\27[2Ja", "b\27[2J") end)
  it("breaks\27[2J", function() error("\27[2J") end)
end)
]]

local folder = command.folder()
folder:write("scene.lua", scene)
folder:write("study.lua", study)
folder:write("test_it.lua", tests)
folder:write("points.csv", "Px,Py,Pz,heat\27[2J,group:some\27[2J\n1,2,3,4,1\n")
folder:write("others.csv", "Px,Py,Pz,heat\27[2J,group:some\27[2J\n1,2,3,5,0\n")

describe("printed text", function()
  it("holds no command of a terminal, whatever names are", function()
    -- Command lines with their status.
    for arguments, status in pairs {
      ["run scene.lua -f 1-3 -o 'out/\27[2J.####.csv' --stats stats.json"] = 0, ["check scene.lua"] = 0,
      ["check scene.lua --races"] = 0, ["explain scene.lua"] = 0, ["explain scene.lua --json"] = 0,
      ["run scene.lua -f 1 -o 'a\27[2J.xyz'"] = 2, ["run scene.lua --set '\27[2J=3'"] = 2, ["run '\27[2J.lua'"] = 2,
      ["run scene.lua '--\27[2J'"] = 2, ["study study.lua --repeat 1 -o out"] = 0, ["info points.csv"] = 0,
      ["info --json points.csv"] = 0, ["diff points.csv others.csv"] = 1, ["diff --json points.csv others.csv"] = 1,
      ["info '\27[2J.csv'"] = 2, ["test test_it.lua"] = 1, ["test --format tap test_it.lua"] = 1,
      ["test --format junit test_it.lua"] = 1, ["test --filter '[\27[2J' test_it.lua"] = 2, ["nodes '\27[2J'"] = 2,
      ["new '\27[2J'"] = 2, ["run scene.lua --plugin '\27[2J.so'"] = 2, ["run scene.lua --events '\27[2J.xyz'"] = 2,
    } do
      local result = command.rapid(arguments, { cwd = folder.path })
      assert.equal(status, result.status, arguments .. ": " .. result.stderr)
      for _, text in ipairs { result.stdout, result.stderr } do
        assert.falsy(text:find "[%z\1-\8\11-\31\127]", arguments .. ": " .. text)
        assert.falsy(text:find("\194\155", 1, true), arguments)
      end
    end
  end)

  it("shows the original string", function()
    local result = command.rapid("run scene.lua -f 1", { cwd = folder.path })
    assert.truthy(result.stdout:find("of the scene: \\x1b[2J\t\\x9b\t\\x0d\n", 1, true), result.stdout)
    assert.falsy(result.stdout:find(clear, 1, true))
  end)
end)
