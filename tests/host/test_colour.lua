-- Points without a colour, in one set with points that have one.
local command = require "testing.command"

describe("Cd", function()
  it("is white for the points of an emitter that gives none, as in Houdini", function()
    local folder = command.folder()
    folder:write("scene.lua", [[
local rapid = require "rapid"
return rapid.create {}
  :emit { source = rapid.mesh.sphere {}, rate = 240 }
  :emit { source = rapid.mesh.sphere {}, rate = 240, attributes = { Cd = {1, 0.5, 0.25}, heat = 3 } } :solve {}
]])
    local points = rapid.run(folder:file "scene.lua", { frames = {2, 2} })[2]
    assert.equal(20, #points)
    for i = 1, 20 do
      local first = points[i].id < 10
      assert.equal(first and vec3(1, 1, 1) or vec3(1, 0.5, 0.25), points[i].Cd)
      assert.equal(first and 0 or 3, points[i].heat)
    end
  end)
end)
