-- :align: the directions of the axes of orient.
local scene = require "testing.scene"

local function run(parameters, frames)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},
    N = {{2, 0, 0}, {0, -1, 0.001}, {0, 0, 0}} } }
  :align { %s } :solve {}]]):format(parameters or ""), { frames = {frames or 2, frames or 2} })[frames or 2]
end

describe("align", function()
  it("points an axis along an attribute, by the shortest way", function()
    local points = run()
    assert.near({1, 0, 0}, points[1].orient:rotate(vec3(0, 1, 0)), 1e-6)
    assert.near({0, 0, 1}, points[1].orient:rotate(vec3(0, 0, 1)), 1e-6) -- the axis of rotation is unchanged
    assert.near({0, -1, 0.001}, points[2].orient:rotate(vec3(0, 1, 0)), 1e-5)
    assert.equal(quat(0, 0, 0, 1), points[3].orient)
    assert.near({1, 0, 0}, run("axis = {0, 0, 3}")[1].orient:rotate(vec3(0, 0, 1)), 1e-6)
  end)

  it("comes nearer by 1/e in the response time", function()
    local up = run("response = 0.5", 25)[1].orient:rotate(vec3(0, 1, 0))
    assert.near(math.pi / 2 * math.exp(-2), math.atan2(up.y, up.x), 1e-4)
  end)
end)
