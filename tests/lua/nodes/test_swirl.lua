-- :swirl against its closed form.
local scene = require "testing.scene"

describe("swirl", function()
  it("accelerates about its axis, whatever the axis's length, in proportion to the distance from it", function()
    local result = scene.run([[
return rapid.create { fps = 10, points = rapid.points.from { P = {{2, 5, 0}, {1, 0, 0}, {1, 3, 4}} } }
  :swirl { axis = {0, 7, 0}, center = {1, 0, 0}, strength = 3 } :solve {}]], { frames = {2, 2} })
    -- strength n x (P - center) dt
    assert.near({0, 0, -0.3}, result[2][1].v, 1e-7)
    assert.near({0, 0, 0}, result[2][2].v, 0)
    assert.near({1.2, 0, 0}, result[2][3].v, 1e-7)
  end)

  it("turns a newborn point for the part of the frame that it has lived", function()
    local result = scene.run([[
return rapid.create { fps = 10 } :emit { source = rapid.points.from { P = {{1, 0, 0}} }, count = 4, birth = "even" }
  :swirl { strength = 2 } :solve {}]], { frames = {2, 2} })
    for k = 0, 3 do assert.near({0, 0, -2 * 0.1 * (3 - k) / 4}, result[2]:by_id(k).v, 1e-7) end
  end)
end)
