-- :follow_curve: points are on the curve at the end of each frame, whatever their birth time.
local scene = require "testing.scene"

describe("follow_curve", function()
  it("goes through the curve's points at even times, and straight on after the end", function()
    local result = scene.run([[
return rapid.create { fps = 4, points = rapid.points.from { P = {{10, 0, 0}} } }
  :follow_curve { points = {{0, 0, 0}, {1, 2, 0}, {3, 2, 1}, {4, 0, 1}}, duration = 1.5 } :solve {}]],
      { frames = {1, 11} })
    -- Two frames per span.
    for f, expected in pairs { [1] = {10, 0, 0}, [3] = {11, 2, 0}, [5] = {13, 2, 1}, [7] = {14, 0, 1} } do
      assert.near(expected, result[f][1].P, 3e-6)
    end
    -- The midpoint of the inner span: (9 (b + c) - a - d) / 16.
    assert.near({10 + (9 * 4 - 4) / 16, 36 / 16, 8 / 16}, result[4][1].P, 3e-6)
    -- The last tangent is the last span's: (1, -2, 0) in half a second.
    assert.near({2, -4, 0}, result[11][1].v, 1e-5)
    assert.near({14 + 2, -4, 1}, result[11][1].P, 1e-5)
  end)

  it("moves points by their age: all points born at one position lie on the curve", function()
    local result = scene.run([[
return rapid.create { fps = 10 } :emit { source = rapid.points.from { P = {{0, 0, 0}} }, rate = 70, birth = "even" }
  :follow_curve { points = {{1, 1, 1}, {2, 1, 4}}, duration = 2 } :solve {}]], { frames = {1, 15} })
    local points = result[15]
    assert.equal(98, #points)
    for i = 1, #points do
      local t = points[i].age / 2
      assert.near({t, 0, 3 * t}, points[i].P, 2e-6)
    end
  end)

  it("needs two points", function()
    assert.truthy(scene.error("return rapid.create { points = two } :follow_curve { points = {{0, 0, 0}} } :solve {}")
      :find("points: a curve needs at least two", 1, true))
  end)
end)
