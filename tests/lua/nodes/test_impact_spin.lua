-- :impact_spin: after an impact a ball rotates as if it rolled.
local scene = require "testing.scene"

local function run(grip)
  return scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.3, 0}}, v = {{3, -2, 1}}, pscale = {0.1},
    w = {{0, 0, 5}} } }
  :impact_spin { grip = %g } :collide { shape = rapid.shape.plane {}, bounce = 0.5, record = true } :solve {}]])
    :format(grip), { frames = {1, 6} })
end

describe("impact_spin", function()
  -- The floor is hit after 0.1 s, in frame 4. Rolling along (3, 1) is a rotation about (1, -3), at v / r.
  it("sets points rolling in the frame after they have hit", function()
    for _, grip in ipairs { 1, 0.25, 0 } do
      local result = run(grip)
      assert.near({0, 0, 5}, result[4][1].w, 0)
      assert.near(vec3(0, 0, 5) * (1 - grip) + vec3(10, 0, -30) * grip, result[5][1].w, 1e-4)
      assert.near(result[5][1].w, result[6][1].w, 0)
    end
    -- The contact point of a rolling ball is at rest.
    local p = run(1)[5][1]
    local slip = vec3(p.v.x, 0, p.v.z) + p.w:cross(vec3(0, -0.1, 0))
    assert.near({0, 0, 0}, slip, 1e-5)
  end)
end)
