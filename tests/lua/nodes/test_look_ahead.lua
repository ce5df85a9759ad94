-- :look_ahead: obstacles are passed without contact, at the same speed, and clear paths do not change.
local scene = require "testing.scene"

local function run(shape, options)
  return scene.run(([[
local P, v = {}, {}
for j = -10, 10 do
  for k = -10, 10 do
    P[#P + 1], v[#v + 1] = {-3, 0.1 * j, 0.1 * k}, {1.5, 0, 0}
  end
end
return rapid.create { fps = 24, points = rapid.points.from { P = P, v = v } }
  :look_ahead { shape = %s, %s } :solve {}]]):format(shape, options), { frames = {1, 96} })
end

describe("look_ahead", function()
  it("passes a ball without contact", function()
    local result = run("rapid.shape.sphere { radius = 0.6 }", "time = 1.5, clearance = 0.1, strength = 30")
    for _, points in result:frames() do
      assert.points(points).outside(function(P) return P:length() - 0.68 end)
    end
    local points = result[96]
    assert.is_true(points:min("P").x > 1)
    for i = 1, #points do
      local p = points[i]
      assert.near(1.5, p.v:length(), 1e-5)
      if result[1][i].P.y ^ 2 + result[1][i].P.z ^ 2 > 0.7 ^ 2 then assert.near({1.5, 0, 0}, p.v, 0) end
    end
  end)

  it("passes a box, which it meets face-on", function()
    local result = run("rapid.shape.box { size = {0.6, 9, 0.6} }", "time = 1.5, clearance = 0.15, strength = 30")
    for _, points in result:frames() do
      assert.points(points).outside(function(P) return math.max(math.abs(P.x), math.abs(P.z)) - 0.3 end)
    end
    assert.is_true(result[96]:min("P").x > 1)
  end)

  it("turns with four times the missing distance over the time squared", function()
    local p = scene.run([[
return rapid.create { fps = 240, points = rapid.points.from { P = {{-1, 0.5, 0}}, v = {{2, 0, 0}} } }
  :look_ahead { shape = rapid.shape.sphere { radius = 0.6 }, clearance = 0.1, strength = 100 } :solve {}]],
      { frames = {2, 2} })[2][1]
    -- The path is nearest at (0, 0.5, 0), after half a second: 0.2 m are missing. Steps in the ball are below 0.1 m.
    local off = 0.1 / 2
    assert.is_true(p.v.y * 240 > 4 * (0.2 - off ^ 2) / (0.5 + off / 2) ^ 2)
    assert.is_true(p.v.y * 240 < 4 * 0.2 / (0.5 - off / 2) ^ 2)
    assert.near(2, p.v:length(), 1e-6)
  end)

  it("does nothing when it moves away", function()
    local p = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0.65, 0, 0}}, v = {{2, 0, 0}} } }
  :look_ahead { shape = rapid.shape.sphere { radius = 0.6 } } :solve {}]], { frames = {2, 2} })[2][1]
    assert.near({2, 0, 0}, p.v, 0)
  end)
end)
