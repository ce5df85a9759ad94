-- :color_by_speed against its closed form.
local scene = require "testing.scene"

describe("color_by_speed", function()
  it("is linear in the speed between its two, and held beyond them", function()
    local points = scene.run([[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}},
  v = {{0, 0.5, 0}, {0, 0, 2}, {3, 4, 0}, {9, 0, 0}} } }
  :color_by_speed { slow = {0, 0, 1}, fast = {1, 0.5, 0}, low = 1, high = 9 } :solve {}]], { frames = {2, 2} })[2]
    for i, t in ipairs { 0, 1 / 8, 4 / 8, 1 } do assert.near({t, t / 2, 1 - t}, points[i].Cd, 1e-7) end
  end)
end)
