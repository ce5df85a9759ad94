-- :avoid against its closed form.
local scene = require "testing.scene"

describe("avoid", function()
  it("pushes out of the shape, linearly less with the distance, and not beyond it", function()
    local points = scene.run([[
return rapid.create { fps = 10,
    points = rapid.points.from { P = {{0, 1.25, 0}, {-1, 0, 0}, {0, 0, 0.5}, {0, 0, 1.51}} } }
  :avoid { shape = rapid.shape.sphere { radius = 1 }, distance = 0.5, strength = 8 } :solve {}]],
      { frames = {2, 2} })[2]
    assert.near({0, 0.4, 0}, points[1].v, 1e-6)
    assert.near({-0.8, 0, 0}, points[2].v, 1e-6)
    assert.near({0, 0, 0.8}, points[3].v, 1e-6)
    assert.near({0, 0, 0}, points[4].v, 0)
  end)
end)
