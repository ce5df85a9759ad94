-- :fade_by_age against the age in its output.
local scene = require "testing.scene"

describe("fade_by_age", function()
  it("is linear in the age from hold to the end of the life", function()
    local result = scene.run([[
return rapid.create { fps = 12, seed = 3 }
  :emit { source = rapid.mesh.sphere {}, rate = 600, life = {0.5, 1.5}, attributes = { heat = 9 } }
  :fade_by_age { attribute = "heat", first = 2, last = -1, hold = 0.25 } :solve {}]], { frames = {1, 12} })
    local points, held, faded = result[12], 0, 0
    for i = 1, #points do
      local p = points[i]
      local t = math.max(0, (p.age / p.life - 0.25) / 0.75)
      assert.near(2 - 3 * t, p.heat, 1e-5)
      if t == 0 then held = held + 1 else faded = faded + 1 end
    end
    assert.is_true(held > 20 and faded > 20)
  end)

  it("keeps the first value of a point that lives for ever", function()
    local result = scene.run("return rapid.create { points = two } :fade_by_age { first = 0.25 } :solve {}")
    assert.equal(0.25, result[3][1].pscale)
  end)
end)
