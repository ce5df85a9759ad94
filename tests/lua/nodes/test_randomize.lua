-- :randomize: bounds, mean and constancy.
local scene = require "testing.scene"

local function run(arguments)
  return scene.run(([[
return rapid.create { points = rapid.points.grid { size = {2, 2, 2}, spacing = 0.1 } } :attribute { heat = 0 }
  :randomize { %s } :solve {}]]):format(arguments), { frames = {1, 3} })
end

describe("randomize", function()
  it("gives values from min to max, the same in each frame", function()
    local result = run "attribute = 'heat', min = -1, max = 3"
    local points, count = result[3], #result[3]
    assert.is_true(points:min "heat" >= -1 and points:max "heat" <= 3)
    assert.near(1, points:mean "heat", 5 * 4 / math.sqrt(12 * count))
    for i = 1, count do assert.equal(result[2][i].heat, points[i].heat) end
  end)

  it("is refused before the first frame for an attribute of vectors, at the line of the scene", function()
    local reported = scene.command("check", [[
return rapid.create { points = two } :attribute { w = {0, 1, 0} }
  :randomize { attribute = "w" } :tumble {} :solve {}]])
    assert.equal(2, reported.status)
    assert.match('^scene%.lua:2: node "randomize1": attribute = "w" is a vec3; it must be an attribute with one number '
      .. "per point\n$", reported.stderr)
    assert.equal(0, scene.command("check", "return rapid.create { points = two } :randomize {} :solve {}").status)
  end)

  it("prefers small ones by its bias: the mean of r^b is 1 / (b + 1)", function()
    local points = run("bias = 3")[3]
    assert.near(1 / 4, points:mean "pscale", 5 * math.sqrt(1 / 7 - 1 / 16) / math.sqrt(#points))
  end)
end)
