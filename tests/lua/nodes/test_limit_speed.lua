-- :limit_speed against its closed form.
local scene = require "testing.scene"

local function velocities(arguments)
  local points = scene.run(([[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}},
  v = {{3, 4, 0}, {0, 0.1, 0}, {0, 0, 0}, {0, 0, -2}} } } :limit_speed { %s } :solve {}]]):format(arguments),
    { frames = {2, 2} })[2]
  return points[1].v, points[2].v, points[3].v, points[4].v
end

describe("limit_speed", function()
  it("shortens and lengthens velocities, and keeps their directions", function()
    local fast, slow, still, right = velocities "min = 1, max = 2.5"
    assert.near({1.5, 2, 0}, fast, 1e-6)
    assert.near({0, 1, 0}, slow, 1e-6)
    assert.near({0, 0, 0}, still, 0)
    assert.near({0, 0, -2}, right, 0)
  end)

  it("changes nothing where no bounds are given", function()
    local fast, slow = velocities ""
    assert.near({3, 4, 0}, fast, 0)
    assert.near({0, 0.1, 0}, slow, 1e-8)
  end)

  it("refuses bounds that exclude each other", function()
    local message = scene.error [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, v = {{1, 0, 0}} } }
  :limit_speed { min = 3, max = 2 } :solve {}]]
    assert.truthy(message:find("lo = 3 is above hi = 2", 1, true), message)
  end)
end)
