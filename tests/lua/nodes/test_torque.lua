-- :torque against w = t torque / I.
local scene = require "testing.scene"

local function run(columns, parameters)
  return scene.run(([[
return rapid.create { fps = 10, points = rapid.points.from { P = {{0, 0, 0}}, %s } } :torque { %s } :solve {}]])
    :format(columns, parameters), { frames = {11, 11} })[11][1]
end

describe("torque", function()
  it("turns solid spheres, and whatever has the moment of inertia that is given", function()
    assert.near({0, 0.3 / (0.4 * 2 * 0.25), 0}, run("mass = {2}, pscale = {0.5}", "torque = {0, 0.3, 0}").w, 1e-5)
    assert.near({-2, 0, 6}, run("w = {{0, 0, 2}}", "torque = {-1, 0, 2}, inertia = 0.5").w, 1e-5)
  end)

  it("says that a point without size has no moment of inertia", function()
    local message = scene.error "return rapid.create { points = two } :torque { torque = {1, 0, 0} } :solve {}"
    assert.truthy(message:find("a point of pscale 0 has no moment of inertia; give it a pscale, or inertia", 1, true),
      message)
  end)
end)
