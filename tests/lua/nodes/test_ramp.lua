-- :ramp against hand-computed numbers.
local scene = require "testing.scene"

local function points(columns, arguments)
  return scene.run(([[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {3, 4, 0}}, %s } } :ramp { %s } :solve {}]])
    :format(columns, arguments), { frames = {2, 2} })[2]
end

describe("ramp", function()
  it("carries a float to a colour, linear between keys", function()
    local found = points("heat = {0.25, 2}, Cd = {{0, 0, 0}, {0, 0, 0}}",
      "from = 'heat', keys = {{0, {1, 0, 0}}, {1, {0, 1, 0}}, {3, {0, 0, 1}}}")
    assert.near({0.75, 0.25, 0}, found[1].Cd, 1e-7)
    assert.near({0, 0.5, 0.5}, found[2].Cd, 1e-7)
  end)

  it("carries a vec3's length to a float", function()
    local found = points("heat = {9, 9}", "from = 'P', to = 'heat', keys = {{1, 10}, {9, 18}}")
    assert.near(10, found[1].heat, 0)
    assert.near(14, found[2].heat, 1e-6)
  end)

  it("looks up the age as a part of the life", function()
    local result = scene.run([[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, life = {1, 4, math.huge} } }
  :attribute { heat = -1 } :solve {} :ramp { from = "nage", to = "heat", keys = {{0, 0}, {1, 10}} }]],
      { frames = {1, 20} })
    for f = 2, 20 do
      local age = (f - 1) / 24
      assert.near(10 * age, result[f]:by_id(0).heat, 1e-5)
      assert.near(10 * age / 4, result[f]:by_id(1).heat, 1e-5)
      assert.equal(0, result[f]:by_id(2).heat) -- its life is infinite
    end
  end)

  it("says that what kernels compute is read-only, and no attribute of other nodes", function()
    local chain = "return rapid.create { points = two } :attribute { heat = 0 } %s :solve {}"
    local function fault(node) return scene.error(chain:format(node)) end
    assert.truthy(fault(":ramp { to = 'nage' }"):find('to = "nage": this attribute is read-only', 1, true))
    assert.truthy(fault(":collide { shape = rapid.shape.plane {}, bounce = rapid.attr 'nage' }"):find(
      '"nage" is not an attribute; only kernels compute p.nage', 1, true))
  end)

  it("refuses keys of another type than the attribute", function()
    local message = scene.error [[
return rapid.create { points = two } :attribute { heat = 0 } :ramp { from = "age", to = "heat" } :solve {}]]
    assert.truthy(message:find('attribute "heat" takes a number, not vec3(1, 1, 1)', 1, true), message)
  end)
end)
