-- :nearest_place against closed forms.
local scene = require "testing.scene"

local function run(shape, parameters, frames)
  return scene.run(([[
local shape = %s
return rapid.create { fps = 10, points = rapid.points.from { P = {{0, 3, 0}, {0.1, 0, 0}, {2, -2, 1}} } }
  :attribute { other = {0, 0, 0} } :nearest_place { shape = shape %s } :solve {}]]):format(shape, parameters or ""),
    { frames = {2, frames or 2} })
end

describe("nearest_place", function()
  it("is on the surface, from outside and inside", function()
    local points = run("rapid.shape.sphere { radius = 0.5 }")[2]
    for i, P in ipairs { vec3(0, 3, 0), vec3(0.1, 0, 0), vec3(2, -2, 1) } do
      assert.near(P:normalized() * 0.5, points[i].goal, 1e-6)
    end
    assert.near({0, 0, 0}, points[1].other, 0)
    assert.near({0, 0.5, 0}, run("rapid.shape.sphere { radius = 0.5 }", ", into = 'other'")[2][1].other, 1e-6)
  end)

  it("is on a mesh, at any distance", function()
    local points = run("rapid.mesh.box { size = {2, 2, 2} }")[2]
    assert.near({0, 1, 0}, points[1].goal, 1e-6)
    assert.near({1, 0, 0}, points[2].goal, 1e-6)
    assert.near({1, -1, 1}, points[3].goal, 1e-6)
  end)

  it("moves with what moves", function()
    local result = run("rapid.mesh.box { size = {2, 2, 2} }:transform(function(frame) return " ..
      "rapid.translate(0, frame.time, 0) end)", "", 6)
    for frame = 2, 6 do assert.near({0, 1 + (frame - 1) / 10, 0}, result[frame][1].goal, 1e-6) end
  end)
end)
