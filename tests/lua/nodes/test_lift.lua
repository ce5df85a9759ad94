-- :lift against its closed form.
local scene = require "testing.scene"

describe("lift", function()
  it("raises by the heat, cools by e in the cooling time, and puts the cold into a group", function()
    local result = scene.run([[
return rapid.create { fps = 10, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, heat = {1, 0.0105} } }
  :lift { strength = 3, cooling = 0.5 } :solve {}]], { frames = {1, 6} })
    local speed = 0
    for f = 2, 6 do
      speed = speed + 3 * math.exp(-(f - 2) * 0.1 / 0.5) * 0.1
      assert.near({0, speed, 0}, result[f][1].v, 1e-6)
      assert.near(math.exp(-(f - 1) * 0.1 / 0.5), result[f][1].heat, 1e-6)
      assert.is_true(result[f][2]:within "cold")
      assert.is_false(result[f][1]:within "cold")
    end
  end)
end)
