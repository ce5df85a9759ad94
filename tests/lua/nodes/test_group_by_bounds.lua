-- :group_by_bounds: the members of the group, frame by frame.
local scene = require "testing.scene"

describe("group_by_bounds", function()
  it("holds the points in the box, faces included, and lets go of those that leave it", function()
    local result = scene.run([[
return rapid.create { fps = 1, points = rapid.points.from { P = {{0, 0, 0}, {-2, 1, 0}, {1, 1, 1}, {1, 1.001, 1}} } }
  :group_by_bounds { into = "box", min = {-1, -1, -1}, max = {1, 1, 1} }
  :points("walk", function(p) p.P = p.P + vec3(1, 0, 0) end) :solve {}]], { frames = {1, 4} })
    -- The group of frame f depends on the positions at frame f - 1.
    for f, expected in pairs { [2] = { 0, 2 }, [3] = { 0, 1 }, [4] = { 1 } } do
      local ids, points = {}, result[f]:group "box"
      for i = 1, #points do ids[i] = points[i].id end
      assert.same(expected, ids)
    end
  end)
end)
