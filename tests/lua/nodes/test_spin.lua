-- :spin against its angle of rotation.
local scene = require "testing.scene"

describe("spin", function()
  it("turns by its rate times the time", function()
    local result = scene.run([[
return rapid.create { fps = 10, points = two } :spin { axis = {0, 0, 3}, rate = 45 } :solve {}]], { frames = {1, 41} })
    assert.equal(quat(0, 0, 0, 1), result[1][1].orient)
    for _, f in ipairs { 2, 11, 41 } do
      local angle = math.rad(45 * (f - 1) / 10)
      assert.near({math.cos(angle), math.sin(angle), 0}, result[f][2].orient:rotate(vec3(1, 0, 0)), 1e-5)
    end
  end)

  it("gives each point its own rate, which stays constant", function()
    local result = scene.run([[
return rapid.create { fps = 10, points = rapid.points.grid { size = {2, 1, 1}, spacing = 0.1 } }
  :spin { rate = 100, variation = 0.5 } :solve {}]], { frames = {1, 11} })
    local sum, count = 0, #result[2]
    for i = 1, count do
      -- orient is a rotation about y, so the angle is twice atan2(y, w).
      local first = math.deg(2 * math.atan2(result[2][i].orient.y, result[2][i].orient.w)) * 10
      local later = math.deg(2 * math.atan2(result[11][i].orient.y, result[11][i].orient.w))
      assert.is_true(first >= 50 - 1e-3 and first <= 150 + 1e-3)
      assert.near(first, later, 0.01)
      sum = sum + first
    end
    assert.near(100, sum / count, 5 * 100 * 0.5 / math.sqrt(3 * count))
  end)
end)
