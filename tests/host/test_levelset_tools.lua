-- Level-set tools, called from graphs. tests/shapes/level_set/test_level_set_tools.cpp checks their results.
local scene = require "testing.scene"

local ball = "rapid.levelset.sphere { radius = 1, voxel = 0.05 }"

-- Returns the distance of (x, 0, 0) from a shape.
local function distance(shape, x)
  local result = scene.run(([[
local shape = %s
return rapid.create { points = two } :attribute { d = 0 }
  :points("ask", function(p) p.d = shape:distance(vec3(%g, 0, 0)) end)
  :solve {}]]):format(shape, x), { frames = {2, 2} })
  return result[2][1].d
end

local function error_of(shape)
  return scene.error(("local s = %s return rapid.create {} :emit { source = s, rate = 1 } :solve {}"):format(shape))
end

describe("a level set", function()
  it("is combined, grown, smoothed, resampled and moved by its methods", function()
    local other = ball .. ":transform(rapid.translate(1, 0, 0))"
    assert.near(0.05, distance(ball .. ":union(" .. other .. ")", 2.05), 1e-3)
    assert.near(0.05, distance(ball .. ":intersect(" .. other .. ")", 1.05), 1e-2)
    assert.near(0.05, distance(ball .. ":subtract(" .. other .. ")", -1.05), 1e-3)
    assert.near(-0.05, distance(ball .. ":offset(0.1)", 1.05), 1e-3)
    -- Twice a variance of 8/3 voxel² along each axis: the distance grows by this divided by the radius.
    assert.near(0.05 + 2 * 8 / 3 * 0.05 ^ 2, distance(ball .. ":smooth { iterations = 2 }", 1.05), 1e-3)
    -- The mesh from which it is resampled is 0.4 voxel² / r inside the ball; a cell interpolates to voxel² / 4r.
    assert.near(0.05, distance(ball .. ":resample(0.04)", 1.05), 0.4 * 0.05 ^ 2 + 0.04 ^ 2 / 4)
    assert.near(0.05, distance(ball .. ":transform(rapid.rotate({0, 1, 0}, 20) * rapid.scale(2))", 2.05), 1e-3)
  end)

  it("is made of points, with the radius that is given or that they have", function()
    assert.near(0.05, distance("rapid.levelset.from_points(two, { radius = 0.3, voxel = 0.05 }) "
      .. ":transform(rapid.translate(0, -1, 0))", 1.35), 1e-3)
    local balls = "rapid.points.from { P = {{0, 0, 0}, {2, 0, 0}}, pscale = {0.5, 0.2} }"
    assert.near(0.05, distance(("rapid.levelset.from_points(%s, { voxel = 0.05 })"):format(balls), 2.25), 1e-3)
    assert.truthy(error_of("rapid.levelset.from_points(two, { voxel = 0.05 })"):find(
      "rapid.levelset.from_points: the radius of the spheres is unknown; give radius, or give the points the " ..
        "attribute pscale", 1, true))
  end)

  it("of which nothing is left is refused, by the method's name", function()
    assert.truthy(error_of(ball .. ":subtract(" .. ball .. ":offset(0.2))"):find(
      ":subtract: nothing is left of the difference; the second covers the first", 1, true))
    assert.truthy(error_of(ball .. ":offset(-3)"):find(":offset: nothing is left of", 1, true))
    assert.truthy(error_of(ball .. ":union(3)"):find(
      ":union: other = 3 has the wrong type; it must be a level set", 1, true))
    assert.truthy(error_of(ball .. ":resample(0)"):find(":resample: voxel = 0 is out of range", 1, true))
    assert.truthy(error_of(ball .. ":offest(1)"):find('a level set has no "offest"; did you mean "offset"?', 1, true))
  end)

  it("of another voxel size is resampled, and the run says so", function()
    local result = scene.command("run", ([[
local s = %s:union(rapid.levelset.sphere { radius = 0.5, voxel = 0.1, center = {1, 0, 0} })
return rapid.create {} :emit { source = s, rate = 10 } :solve {}]]):format(ball), "-f 1-2 --quiet")
    assert.equal(0, result.status)
    local said = "the second level set has a voxel of 0.1 m and the first of 0.05 m"
    assert.truthy(result.stderr:find(said, 1, true), result.stderr)
  end)
end)
