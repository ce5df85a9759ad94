-- :group_by_shape: the members of the group.
local scene = require "testing.scene"

local function ids(shape, more)
  local points = scene.run(([[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {0.9, 0, 0}, {0, 1.1, 0}, {0, 0, 3}} } }
  :group_by_shape { into = "near", shape = %s, %s } :solve {}]]):format(shape, more or ""), { frames = {2, 2} })[2]
  local list, group = {}, points:group "near"
  for i = 1, #group do list[i] = group[i].id end
  return list
end

describe("group_by_shape", function()
  it("holds the points within its distance of the surface", function()
    local ball = "rapid.shape.sphere { radius = 1 }"
    assert.same({ 0, 1 }, ids(ball))
    assert.same({ 0, 1, 2 }, ids(ball, "distance = 0.2"))
    assert.same({ 0 }, ids(ball, "distance = -0.2"))
  end)

  it("takes level sets, and shapes of the frame", function()
    assert.same({ 0, 1 }, ids "rapid.levelset.sphere { radius = 1, voxel = 0.05 }")
    assert.same({ 0, 1, 2, 3 }, ids "function(frame) return rapid.shape.sphere { radius = 2 * frame.number } end")
  end)
end)
