-- clump: points that have touched hold together until they are torn apart.
local scene = require "testing.scene"

-- Returns the lower of two points, the upper of which is pinned, after two seconds of gravity on 1 kg.
local function hanging(distance, strength)
  local points = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0, -%g, 0}}, pscale = {0.1, 0.1} } }
  :gravity {} :clump { strength = %g }
  :group { name = "top", where = function(p) return p.id == 0 end } :pin { group = "top" }
  :solve { substeps = 8 }]]):format(distance, strength), { frames = {1, 49} })[49]
  return points[2].P.y
end

describe("clump", function()
  it("holds a weight below its strength where it touched", function()
    assert.near(-0.2, hanging(0.2, 12), 1e-4)
  end)

  it("lets a weight above its strength go, which then falls freely", function()
    assert.near(-0.2 - 9.81 * 2, hanging(0.2, 8), 0.5) -- 2 s minus the substeps in which the bond carried its strength
  end)

  it("does not stick points that do not touch", function()
    assert.near(-0.25 - 9.81 * 2, hanging(0.25, 1e6), 1e-3)
  end)

  it("sticks points that come to touch", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from {
    P = {{-0.5, 0, 0}, {0.5, 0, 0}}, v = {{1, 0, 0}, {-1, 0, 0}}, pscale = {0.1, 0.1} } }
  :contact {} :clump { strength = 1e6 } :wind { velocity = {0, 3, 0}, drag = 1 } :solve { substeps = 8 }]],
      { frames = {1, 96} })
    local p = result[96]
    assert.near(0.2, (p[1].P - p[2].P):length(), 5e-3)
    assert.near(0, p[1].P.x + p[2].P.x, 1e-5) -- momentum
  end)

  it("takes no more than its strength from points that tear apart", function()
    for _, substeps in ipairs({1, 4, 16}) do
      local plane = ":collide { shape = rapid.shape.plane { offset = -100 } }"
      for _, other in ipairs { "", plane, ":drag { linear = 0 }" } do
        local p = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from {
    P = {{0, 1, 0}, {0.2, 1, 0}}, v = {{0, 0, 0}, {1, 0, 0}}, pscale = {0.1, 0.1} } }
  :clump { strength = 0.2 } %s :solve { substeps = %d }]]):format(other, substeps), { frames = {1, 4} })[4]
        local impulse = 0.2 / 24 / substeps
        assert.near(impulse, p[1].v.x, 1e-6)
        assert.near(1 - impulse, p[2].v.x, 1e-6)
      end
    end
  end)
end)
