-- :kill_slow: which points are killed, and when.
local scene = require "testing.scene"

local function ids(points)
  local list = {}
  for i = 1, #points do list[i] = points[i].id end
  return list
end

describe("kill_slow", function()
  it("removes the points that are slower than its speed, and no other", function()
    local result = scene.run [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},
  v = {{0.5, 0, 0}, {0.3, 0.399, 0}, {0, 0, 0}} } } :kill_slow { speed = 0.5 } :solve {}]]
    assert.same({ 0, 1, 2 }, ids(result[1]))
    assert.same({ 0 }, ids(result[2]))
  end)

  it("spares the young", function()
    local result = scene.run("return rapid.create { fps = 10, points = two } :kill_slow { age = 0.25 } :solve {}",
      { frames = {1, 5} })
    -- At frame f the points enter the node with the age (f - 2) / 10.
    for f, count in pairs { [2] = 2, [4] = 2, [5] = 0 } do assert.equal(count, #result[f]) end
  end)
end)
