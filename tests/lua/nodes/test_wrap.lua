-- :wrap against its closed form.
local scene = require "testing.scene"

describe("wrap", function()
  it("carries points by whole boxes back into the box", function()
    local points = scene.run([[
return rapid.create { points = rapid.points.from { P = {{0.25, 0, 0}, {1.25, -1.5, 3.5}, {-7.5, 2, 0}} } }
  :wrap { min = {-1, -1, 0}, max = {1, 1, 3} } :solve {}]], { frames = {2, 2} })[2]
    assert.near({0.25, 0, 0}, points[1].P, 0)
    assert.near({-0.75, 0.5, 0.5}, points[2].P, 0)
    assert.near({0.5, 0, 0}, points[3].P, 0)
  end)

  it("refuses a box without room", function()
    assert.truthy(scene.error("return rapid.create { points = two } :wrap { max = {1, -1, 1} } :solve {}")
      :find("max = vec3(1, -1, 1) must be above min = vec3(-1, -1, -1) on each axis", 1, true))
  end)
end)
