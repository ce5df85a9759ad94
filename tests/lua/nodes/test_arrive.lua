-- :arrive against its closed form.
local scene = require "testing.scene"

describe("arrive", function()
  it("goes at its speed up to the radius, and then slows down exponentially, at any frame rate", function()
    for _, fps in ipairs { 3, 24 } do
      local result = scene.run(([[
return rapid.create { fps = %d, points = rapid.points.from { P = {{1, 6, 1}, {1, 2.5, 1}, {1, 2, 1}} } }
  :arrive { target = {1, 2, 1}, speed = 2, radius = 1, response = 1e-6 } :solve {}]]):format(fps),
        { frames = {1, 4 * fps + 1} })
      for f = 2, 4 * fps + 1 do
        local t = (f - 1) / fps
        assert.near({1, 2 + (t < 1.5 and 4 - 2 * t or math.exp(-2 * (t - 1.5))), 1}, result[f][1].P, 1e-5)
        assert.near({1, 2 + 0.5 * math.exp(-2 * t), 1}, result[f][2].P, 1e-5)
        assert.near({1, 2, 1}, result[f][3].P, 0)
      end
    end
  end)

  it("never goes beyond the target, however fast it comes and however slowly it responds", function()
    local result = scene.run([[
local P, v = {}, {}
for k = 1, 40 do P[k], v[k] = {0.05 * k, 0, 0}, {-k, 0, 0} end
return rapid.create { fps = 10, points = rapid.points.from { P = P, v = v } }
  :arrive { speed = 1.5, radius = 0.7, response = 3 } :solve {}]], { frames = {1, 40} })
    for f = 2, 40 do
      for i = 1, 40 do
        local x = result[f][i].P.x
        assert.is_true(x >= 0 and x <= result[f - 1][i].P.x)
      end
    end
    assert.is_true(result[40]:max("P").x < 0.01)
  end)

  it("turns to the target by 1/e in the response time", function()
    local p = scene.run([[
return rapid.create { fps = 10, points = rapid.points.from { P = {{0, 9, 0}}, v = {{4, 0, 0}} } }
  :arrive { speed = 2, response = 0.5 } :solve {}]], { frames = {2, 2} })[2][1]
    assert.near({4 * math.exp(-0.2), -2 * (1 - math.exp(-0.2)), 0}, p.v, 1e-6)
  end)
end)
