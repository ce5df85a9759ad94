-- :follow_leader against its closed form.
local scene = require "testing.scene"

local function run(points, parameters, frames)
  return scene.run(([[
return rapid.create { fps = 10, points = rapid.points.from { %s } }
  :group { name = "head", where = function(p) return p.id == 0 end }
  :follow_leader { leader = "head", length = 0, width = 0, %s } :solve {}]]):format(points, parameters),
    { frames = {1, frames} })
end

describe("follow_leader", function()
  -- The leader moves in a straight line: v' = (w - v) / response, w constant over the frame, then P' = P + v dt.
  it("brings points to the distance from the leader that its formula gives", function()
    local result = run("P = {{0, 0, 0}, {-4, 0, 0}}, v = {{1, 0, 0}, {0, 0, 0}}",
      "distance = 1, time = 0.8, response = 0.3, speed = 100", 40)
    local x, v, kept = -4, 0, math.exp(-0.1 / 0.3)
    for frame = 2, 40 do
      local target = 1 + (0.1 * (frame - 2) - 1 - x) / 0.8
      v = target + (v - target) * kept
      x = x + 0.1 * v
      assert.near({x, 0, 0}, result[frame][2].P, 2e-5)
      assert.near({0.1 * (frame - 1), 0, 0}, result[frame][1].P, 2e-6)
    end
    assert.near(result[40][1].P.x - 1, result[40][2].P.x, 0.15)
  end)

  it("limits points to the speed, and moves none without a leader", function()
    local fast = run("P = {{0, 0, 0}, {50, 0, 0}}, v = {{1, 0, 0}, {0, 0, 0}}", "speed = 2", 20)
    assert.near({-2, 0, 0}, fast[20][2].v, 1e-3)
    local alone = scene.run([[
return rapid.create { points = two } :follow_leader { leader = "nobody" } :group { name = "nobody",
  where = function() return false end } :solve {}]], { frames = {1, 4} })
    assert.near({1, 1, 0}, alone[4][2].P, 0)
  end)

  it("gives each point its own position in the train", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.2 } }
  :points("on", function(p) if p.id == 0 then p.v = vec3(0, 0, 2) end end)
  :group { name = "head", where = function(p) return p.id == 0 end }
  :follow_leader { leader = "head", distance = 0.5, length = 3, width = 0.4, time = 0.2, response = 0.05 } :solve {}]],
      { frames = {96, 96} })
    local head, far, near = result[96]:by_id(0).P, 0, math.huge
    for i = 1, #result[96] do
      local p = result[96][i]
      if p.id ~= 0 then
        local off = head - p.P
        assert.truthy(off.x ^ 2 + off.y ^ 2 <= 0.41 ^ 2)
        far, near = math.max(far, off.z), math.min(near, off.z)
      end
    end
    assert.near(0.5, near, 0.15)
    assert.near(3.5, far, 0.15)
  end)
end)
