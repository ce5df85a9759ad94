-- attributes and speed at birth: between two, on a ramp, integers; each with separate random numbers.
local scene = require "testing.scene"

local function born(attributes, more)
  return scene.run(([[
return rapid.create { fps = 24 } :points("read", function(p) local _ = p.nage end)
  :emit { source = rapid.mesh.sphere {}, count = 4000, birth = "end", attributes = { %s } %s } :solve {}]]):format(
    attributes, more or ""), { frames = {2, 2} })[2]
end

local function mean_and_variance(points, value)
  local sum, squares = 0, 0
  for i = 1, #points do
    local x = value(points[i])
    sum, squares = sum + x, squares + x * x
  end
  local mean = sum / #points
  return mean, squares / #points - mean * mean
end

describe("attributes at birth", function()
  it("are uniform between two numbers", function()
    local points = born "heat = {2, 5}"
    local mean, variance = mean_and_variance(points, function(p) return p.heat end)
    assert.near(3.5, mean, 5 * math.sqrt(0.75 / 4000))
    assert.near(9 / 12, variance, 0.04)
    assert.is_true(points:min "heat" >= 2 and points:max "heat" < 5)
  end)

  it("are on the line between two vectors", function()
    local points = born "Cd = {{1, 0, 0}, {0, 0.5, 1}}"
    for i = 1, #points do
      local Cd = points[i].Cd
      assert.near({1 - Cd.z, 0.5 * Cd.z, Cd.z}, Cd, 1e-6)
    end
    assert.near({0.5, 0.25, 0.5}, points:mean "Cd", 5 * math.sqrt(1 / 12 / 4000))
  end)

  it("are on a ramp, at a uniform position", function()
    local points = born "Cd = {{0, {1, 0, 0}}, {0.25, {0, 1, 0}}, {1, {0, 0, 1}}}"
    local first = 0
    for i = 1, #points do
      local Cd = points[i].Cd
      assert.near(1, Cd.x + Cd.y + Cd.z, 1e-6)
      if Cd.x > 0 then first = first + 1 end
    end
    assert.near(1000, first, 5 * math.sqrt(4000 * 0.25 * 0.75))
  end)

  it("count in whole numbers, each as likely", function()
    local points, counts = born "instance = {1, 4}", {}
    for i = 1, #points do counts[points[i].instance] = (counts[points[i].instance] or 0) + 1 end
    for k = 1, 4 do assert.near(1000, counts[k], 5 * math.sqrt(4000 * 0.25 * 0.75)) end
    assert.is_nil(counts[0])
    assert.is_nil(counts[5])
  end)

  it("draw numbers of their own", function()
    local alone, among = born "heat = {2, 5}", born "heat = {2, 5}, fuel = {2, 5}"
    local covariance = 0
    for i = 1, #alone do
      assert.equal(alone[i].heat, among[i].heat)
      assert.near(alone[i].P, among[i].P, 0)
      covariance = covariance + (among[i].heat - 3.5) * (among[i].fuel - 3.5) / 4000
    end
    assert.near(0, covariance, 5 * 0.75 / math.sqrt(4000))
  end)

  it("have the types of Houdini where they have its names", function()
    assert.truthy(scene.error([[return rapid.create {} :emit { source = rapid.mesh.sphere {}, count = 1,
      attributes = { scale = 2 } } :solve {}]]):find("scale = 2 has the wrong type; it must be a vec3", 1, true))
    assert.truthy(scene.error([[return rapid.create {} :emit { source = rapid.mesh.sphere {}, count = 1,
      attributes = { instance = 0.5 } } :solve {}]]):find("instance = 0.5 is not whole", 1, true))
  end)

  it("refuse ramps that go back, and types that differ", function()
    assert.truthy(scene.error([[return rapid.create {} :emit { source = rapid.mesh.sphere {}, count = 1,
      attributes = { heat = {{0, 1}, {0, 2}} } } :solve {}]]):find("keys must increase from 0 to 1", 1, true))
    assert.truthy(scene.error([[return rapid.create {} :emit { source = rapid.mesh.sphere {}, count = 1,
      attributes = { heat = {{0, 1}, {1, {1, 2, 3}}} } } :solve {}]]):find("values of different types", 1, true))
  end)
end)

describe("speed at birth", function()
  it("is uniform between two", function()
    local points = born("heat = 1", ", speed = {3, 7}")
    local mean, variance = mean_and_variance(points, function(p) return p.v:length() end)
    assert.near(5, mean, 5 * math.sqrt(16 / 12 / 4000))
    assert.near(16 / 12, variance, 0.08)
  end)
end)

describe("p.nage", function()
  it("is the part of its life that a point has lived", function()
    local points = scene.run([[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, life = {0.5, math.huge} } }
  :attribute { part = 0, whole = 0 }
  :points("read", function(p) p.part = p.nage p.whole = p.age / p.life end)
  :detail("same", function(points)
    for i = 1, #points do assert(points[i].nage == points[i].age / points[i].life) end
  end)
  :solve {}]], { frames = {1, 7} })[7]
    assert.near(5 / 24 / 0.5, points[1].part, 1e-6)
    assert.equal(points[1].whole, points[1].part)
    assert.equal(0, points[2].part)
  end)
end)

describe("targetv and airresist", function()
  it("bring a point to a velocity at a rate, exactly at any step", function()
    for _, substeps in ipairs { 1, 5 } do
      local points = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, v = {{4, 0, 0}, {4, 0, 0}} } }
  :points("air", function(p) p.airresist = p.id == 0 and 2.5 or 0 p.targetv = vec3(1, 3, 0) end)
  :solve { substeps = %d }]]):format(substeps), { frames = {1, 13} })[13]
      local rest = math.exp(-2.5 * 0.5)
      assert.near({1 + 3 * rest, 3 * (1 - rest), 0}, points[1].v, 3e-6)
      assert.near({0.5 + 3 * (1 - rest) / 2.5, 3 * (0.5 - (1 - rest) / 2.5), 0}, points[1].P, 3e-6)
      assert.near({4, 0, 0}, points[2].v, 1e-6)
    end
  end)

  it("refuses a rate below 0", function()
    assert.truthy(scene.error([[return rapid.create { points = two } :attribute { airresist = -1 } :solve {}]])
      :find("airresist = -1 is out of range", 1, true))
  end)
end)
