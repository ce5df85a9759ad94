-- :jitter against its documented statistics.
local scene = require "testing.scene"

local function spread(fps, frames)
  local result = scene.run(([[
return rapid.create { fps = %d, points = rapid.points.grid { size = {2, 2, 2}, spacing = 0.1 } }
  :jitter { strength = 3 } :solve {}]]):format(fps, fps), { frames = {1, frames} })
  local points, sum, square = result[frames], vec3(0, 0, 0), 0
  for i = 1, #points do
    sum = sum + points[i].v
    square = square + points[i].v:dot(points[i].v)
  end
  return math.sqrt(square / #points), sum / #points, #points
end

describe("jitter", function()
  it("gives points a root mean square speed of its strength in a second, at any frame rate", function()
    for _, fps in ipairs { 6, 24 } do
      local speed, mean, count = spread(fps, fps + 1)
      assert.equal(8000, count)
      assert.near(3, speed, 3 * 5 / math.sqrt(6 * count)) -- five standard deviations
      assert.near({0, 0, 0}, mean, 3 * 5 / math.sqrt(count))
    end
  end)

  it("kicks each point otherwise in each frame, never harder than the corner of its cube", function()
    local result = scene.run("return rapid.create { fps = 4, points = two } :jitter { strength = 2 } :solve {}",
      { frames = {1, 4} })
    local first, second = result[2][1].v, result[3][1].v - result[2][1].v
    assert.is_true((first - second):length() > 1e-3)
    assert.is_true((first - result[2][2].v):length() > 1e-3)
    for f = 2, 4 do
      local kick = result[f][1].v - result[f - 1][1].v
      assert.is_true(math.max(math.abs(kick.x), math.abs(kick.y), math.abs(kick.z)) <= 2 * math.sqrt(0.25))
    end
  end)
end)
