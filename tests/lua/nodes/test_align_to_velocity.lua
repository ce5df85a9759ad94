-- :align_to_velocity: the directions of the axes of orient.
local scene = require "testing.scene"

local directions = { {0, 0, 1}, {0, 0, -2}, {3, 0, 0}, {1, 2, -3}, {-1, -5, 0.1}, {0.01, 0, -1} }

local function orients(arguments)
  local P, v = {}, {}
  for i, d in ipairs(directions) do
    P[i] = ("{%d, 0, 0}"):format(i)
    v[i] = "{" .. table.concat(d, ", ") .. "}"
  end
  return scene.run(([[
return rapid.create { points = rapid.points.from { P = {%s}, v = {%s} } } :align_to_velocity { %s } :solve {}]])
    :format(table.concat(P, ", "), table.concat(v, ", "), arguments or ""), { frames = {2, 2} })[2]
end

describe("align_to_velocity", function()
  it("points z along v, and y as far up as it can", function()
    local points = orients()
    for i, d in ipairs(directions) do
      local q, forward, up = points[i].orient, vec3(d):normalized(), vec3(0, 1, 0)
      assert.near(forward, q:rotate(vec3(0, 0, 1)), 1e-6)
      assert.near((up - forward * forward.y):normalized(), q:rotate(vec3(0, 1, 0)), 1e-5)
      assert.near(1, q:length(), 1e-6)
    end
  end)

  it("takes another direction for up", function()
    local q = orients("up = {1, 0, 0}")[1].orient
    assert.near({1, 0, 0}, q:rotate(vec3(0, 1, 0)), 1e-6)
  end)

  it("leaves slow points as they are", function()
    local q = orients("least = 1.5")[1].orient
    assert.equal(quat(0, 0, 0, 1), q)
  end)
end)
