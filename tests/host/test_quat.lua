-- quat in kernels: rotations checked against hand-computed numbers, an attribute of this type, refused arguments.
local scene = require "testing.scene"

local half = math.sqrt(0.5)

-- Returns the result of an expression in a kernel: a vec3, or a quat.
local function turned(expression) return scene.kernel("p.P = " .. expression)[1].P end
local function turn(expression)
  return scene.kernel("p.q = " .. expression, "q = {{0, 0, 0, 1}, {0, 0, 0, 1}}")[1].q
end

local function assert_turn(expected, expression)
  local q = turn(expression)
  for k, name in ipairs { "x", "y", "z", "w" } do assert.near(expected[k], q[name], 1e-7) end
end

describe("a quat", function()
  it("turns a vec3 about its axis, counter-clockwise as seen from the axis's end", function()
    for expression, expected in pairs {
      ["rapid.math.rotation(vec3(0, 1, 0), 90):rotate(vec3(0, 0, 1))"] = {1, 0, 0},
      ["rapid.math.rotation(vec3(0, 0, 5), 90):rotate(vec3(1, 2, 3))"] = {-2, 1, 3},
      ["rapid.math.rotation(vec3(1, 1, 1), 120):rotate(vec3(1, 2, 3))"] = {3, 1, 2},
      ["rapid.math.rotation(vec3(1, 1, 1), 120):inverse():rotate(vec3(1, 2, 3))"] = {2, 3, 1},
      ["quat(0, 0, 0, 1):rotate(vec3(1, 2, 3))"] = {1, 2, 3},
    } do
      assert.near(expected, turned(expression), 1e-6)
    end
  end)

  it("is multiplied: q * r turns by r, and then by q", function()
    local q, r = "rapid.math.rotation(vec3(1, 0, 0), 90)", "rapid.math.rotation(vec3(0, 1, 0), 90)"
    assert.near({0, 1, 0}, turned(("(%s * %s):rotate(vec3(1, 0, 0))"):format(q, r)), 1e-6) -- to -z, and then to y
    assert_turn({ 0.5, 0.5, 0.5, 0.5 }, q .. " * " .. r)
  end)

  it("is made from an axis and an angle, or from two directions", function()
    assert_turn({ 0, half, 0, half }, "rapid.math.rotation(vec3(0, 3, 0), 90)")
    assert_turn({ 0, 0, half, half }, "rapid.math.rotation_between(vec3(2, 0, 0), vec3(0, 3, 0))")
    assert_turn({ 0, 0, 0, 1 }, "rapid.math.rotation_between(vec3(1, 2, 3), vec3(2, 4, 6))")
    for _, from in ipairs { "vec3(1, 2, 3)", "vec3(1, 0, 0)", "vec3(0, -1, 0)", "vec3(0, 0, 1)" } do
      local back = turned(("rapid.math.rotation_between(%s, -%s):rotate(%s) + %s"):format(from, from, from, from))
      assert.near({0, 0, 0}, back, 1e-6)
    end
  end)

  it("goes the shortest way at even speed from one to another", function()
    local to = "rapid.math.rotation(vec3(0, 1, 0), 80)"
    local angle = math.rad(80 * 0.25 / 2)
    local expected = { 0, math.sin(angle), 0, math.cos(angle) }
    assert_turn(expected, ("quat(0, 0, 0, 1):slerp(%s, 0.25)"):format(to))
    assert_turn(expected, ("quat(0, 0, 0, 1):slerp(quat(0, -%.17g, 0, -%.17g), 0.25)"):format(math.sin(math.rad(40)),
      math.cos(math.rad(40))))
    assert_turn({ 0, 0, 0, 1 }, "quat(0, 0, 0, 1):slerp(quat(0, 0, 0, 1), 0.5)")
    assert_turn({ 0, 0.6, 0, 0.8 }, "quat(0, 3, 0, 4):normalized()")
  end)

  it("is read and written as an attribute, frame after frame", function()
    local result = scene.run([[
return rapid.create { fps = 10, points = two } :attribute { orient = {0, 0, 0, 1} }
  :points("turn", function(p) p.orient = rapid.math.rotation(vec3(0, 1, 0), 9) * p.orient end) :solve {}]],
      { frames = {1, 11} })
    local q = result[11][2].orient
    assert.near(half, q.y, 1e-6)
    assert.near(half, q.w, 1e-6)
  end)

  it("refuses parts that make no quat", function()
    local place = 'scene.lua:2: node "kernel": '
    for body, expected in pairs {
      ["p.P = quat(0, 0, 0, 1) * p.P"] =
        "can't compute quat(0, 0, 0, 1) * vec3(0, 1, 0); both must be a quat; to turn a vec3, use q:rotate(v)",
      ["p.P = quat(0, 0, 1)"] =
        "quat needs four numbers, quat(0, 0, 0, 1); rapid.math.rotation(axis, degrees) makes one from an axis",
      ["p.q = {0, 0, 0, 1}"] = 'attribute "q" takes a quat, not a table; quat(x, y, z, w) makes one',
      ["p.q = p.P"] = 'attribute "q" takes a quat, not vec3(0, 1, 0)',
      ["p.P = p.q:rotate(1)"] = "q:rotate(v) needs a vec3, not 1",
      ["p.P = p.q.axis"] = 'a quat has no "axis"; it has x, y, z, w, rotate, inverse, length, normalized and slerp',
      ["p.q = rapid.math.rotation(vec3(0, 0, 0), 3)"] =
        "rotation(axis, degrees): vec3(0, 0, 0) has no direction; its length must be above 0",
      ["p.q = rapid.math.rotation_between(p.P, 3)"] = "rotation_between(from, to) needs a vec3, not 3",
    } do
      assert.equal(place .. expected .. " (point id 0, frame 2)",
        scene.kernel_error(body, "q = {{0, 0, 0, 1}, {0, 0, 0, 1}}"))
    end
  end)
end)
