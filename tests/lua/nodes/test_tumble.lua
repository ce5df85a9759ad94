-- :tumble against its angle of rotation.
local scene = require "testing.scene"

describe("tumble", function()
  it("turns by w, which falls by the drag, at any frame rate", function()
    for _, drag in ipairs { 0, 0.5, 3 } do
      for _, fps in ipairs { 2, 24 } do
        local p = scene.run(([[
return rapid.create { fps = %d, points = rapid.points.from { P = {{0, 0, 0}}, w = {{0, 0, 0.7}} } }
  :tumble { drag = %g } :solve {}]]):format(fps, drag), { frames = {2 * fps + 1, 2 * fps + 1} })[2 * fps + 1][1]
        local angle = drag > 0 and 0.7 * (1 - math.exp(-2 * drag)) / drag or 1.4
        assert.near({math.cos(angle), math.sin(angle), 0}, p.orient:rotate(vec3(1, 0, 0)), 2e-6)
        assert.near({0, 0, 0.7 * math.exp(-2 * drag)}, p.w, 1e-6)
      end
    end
  end)

  it("leaves what does not turn as it is", function()
    local p = scene.run("return rapid.create { points = two } :tumble { drag = 1 } :solve {}")[3][1]
    assert.equal(quat(0, 0, 0, 1), p.orient)
    assert.near({0, 0, 0}, p.w, 0)
  end)
end)
