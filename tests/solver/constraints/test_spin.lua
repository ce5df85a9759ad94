-- contact { spin }: the attributes of points that turn.
local scene = require "testing.scene"

local text = [[
return rapid.create { fps = 24, points = rapid.points.from { P = { {0, 0.1, 0} }, v = { {1, 0, 0} } } }
  :gravity {} :attribute { pscale = 0.1 } :collide { shape = rapid.shape.plane {}, friction = 1, bounce = 0 }
  :contact { %s } :solve {}]]

describe("spin of contact", function()
  it("makes w and orient, which follow from each other", function()
    local result = scene.run(text:format "spin = true", { frames = {24, 25} })
    local before, after = result[24][1], result[25][1]
    assert.near({0, 0, -10 * 5 / 7}, after.w, 1e-4)
    local turned = before.orient:rotate(vec3(1, 0, 0)):dot(after.orient:rotate(vec3(1, 0, 0)))
    assert.near(math.cos(10 * 5 / 7 / 24), turned, 1e-5)
  end)

  it("makes nothing where nobody asks, and points slide to rest", function()
    local point = scene.run(text:format "", { frames = {25, 25} })[25][1]
    assert.falsy(pcall(function() return point.w end))
    assert.near({0, 0, 0}, point.v, 1e-6)
  end)

  it("begins with the w that points have", function()
    local spun = text:format("spin = true"):gsub("v = { {1, 0, 0} }", "w = { {0, 0, -70} }")
    assert.near({2, 0, 0}, scene.run(spun, { frames = {25, 25} })[25][1].v, 1e-4)
  end)

  it("has rolling friction only with spin", function()
    assert.match("add spin = true", scene.error(text:format "rolling = 0.1"))
    assert.match("rolling = %-1 is out of range", scene.error(text:format "spin = true, rolling = -1"))
  end)
end)
