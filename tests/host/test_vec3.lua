-- vec3 in graph code: arithmetic checked against hand-computed numbers, and operations that are refused.
local scene = require "testing.scene"

-- Returns the value of an expression of graph code: a vec3, or a number.
local function value(expression, before)
  local text = "%s local value = %s local is_number = type(value) == 'number' " ..
    "return rapid.create { points = rapid.points.from { P = {is_number and {value, 0, 0} or value}, " ..
    "is_number = {is_number and 1 or 0} } }"
  local point = scene.run(text:format(before or "", expression), { frames = {1, 1} })[1][1]
  return point.is_number == 1 and point.P.x or point.P
end

-- Returns the error of an expression, without its position.
local function fault(expression)
  local message = scene.error("local value = " .. expression .. " return rapid.create {}")
  return assert(message:match "^scene%.lua:1: (.*)$", message)
end

describe("a vec3", function()
  it("is computed component by component", function()
    for expression, expected in pairs {
      ["vec3(1, 2, 3) + vec3(10, 20, 40)"] = {11, 22, 43},
      ["vec3(1, 2, 3) - vec3(10, 20, 40)"] = {-9, -18, -37},
      ["vec3(1, 2, 3) * vec3(10, 20, 40)"] = {10, 40, 120},
      ["vec3(1, 2, 3) / vec3(2, 4, 8)"] = {0.5, 0.5, 0.375},
      ["vec3(1, 2, 3) * 2"] = {2, 4, 6},
      ["2 * vec3(1, 2, 3)"] = {2, 4, 6},
      ["vec3(1, 2, 3) / 2"] = {0.5, 1, 1.5},
      ["-vec3(1, -2, 3)"] = {-1, 2, -3},
      ["vec3 {1, 2, 3}"] = {1, 2, 3},
      ["vec3(1, 0, 0):cross(vec3(0, 1, 0))"] = {0, 0, 1},
      ["vec3(2, 3, 4):cross(vec3(5, 6, 7))"] = {-3, 6, -3},
      ["vec3(0, 3, 4):normalized() * 10"] = {0, 6, 8},
      ["vec3(0, 0, 0):normalized()"] = {0, 0, 0},
      ["vec3(1, 2, 3):lerp(vec3(5, 2, -5), 0.25)"] = {2, 2, 1},
    } do
      local found = value(expression)
      assert.near(expected, found, 1e-6)
    end
  end)

  it("measures", function()
    assert.equal(32, value "vec3(1, 2, 3):dot(vec3(4, 5, 6))")
    assert.equal(13, value "vec3(3, 4, 12):length()")
    assert.equal(7, value("v.x + v.y + v.z", "local v = vec3(1, 2, 4)"))
  end)

  it("equals one of the same components, and no other value", function()
    assert.equal(1, value "vec3(1, 2, 3) == vec3(1, 2, 3) and 1 or 0")
    assert.equal(0, value "vec3(1, 2, 3) == vec3(1, 2, 4) and 1 or 0")
    assert.equal(0, value "vec3(1, 2, 3) == 1 and 1 or 0")
    assert.equal(0, value "vec3(1, 2, 3) == nil and 1 or 0")
  end)

  it("is written as the call that makes it", function()
    assert.equal(1, value "tostring(vec3(1, -2.5, 1e-9)) == 'vec3(1, -2.5, 1e-09)' and 1 or 0")
    assert.equal(1, value "('%s'):format(vec3(0, 0, 1)) == 'vec3(0, 0, 1)' and 1 or 0")
    assert.equal(1, value "'at ' .. vec3(0, 0, 1) .. '.' == 'at vec3(0, 0, 1).' and 1 or 0")
  end)

  it("does not change", function()
    local change = "local v = vec3(1, 2, 3) v.%s = 1 return rapid.create {}"
    assert.equal("scene.lua:1: a component of a vector or a field of the frame can't be assigned; make a new vec3: " ..
      "p.v = vec3(1, p.v.y, p.v.z)", scene.error(change:format "x"))
    assert.equal("scene.lua:1: a vec3 has no \"q\", and can't be changed; make a new one: vec3(x, y, z)",
      scene.error(change:format "q"))
  end)

  it("does not change under a kernel either", function()
    local message = scene.kernel_error "p.v.x = 1"
    assert.match("^scene.lua:2: node \"kernel\": a component of a vector or a field of the frame can't be assigned",
      message)
  end)
end)

describe("an operation on a vec3", function()
  it("names the operand that it can't use, and those that it could", function()
    for expression, expected in pairs {
      ["vec3(1, 2, 3) + nil"] = "can't compute vec3(1, 2, 3) + nil; both must be a vec3",
      ["1 + vec3(1, 2, 3)"] = "can't compute 1 + vec3(1, 2, 3); both must be a vec3",
      ["vec3(1, 2, 3) - {1, 2, 3}"] = "can't compute vec3(1, 2, 3) - a table; both must be a vec3",
      ["vec3(1, 2, 3) * nil"] = "can't compute vec3(1, 2, 3) * nil; the other must be a number or a vec3",
      ["'2' * vec3(1, 2, 3)"] = "can't compute a string * vec3(1, 2, 3); the other must be a number or a vec3",
      ["1 / vec3(1, 2, 3)"] = "can't compute 1 / vec3(1, 2, 3); a vec3 can only be divided by a number or a vec3",
      ["vec3(1, 2, 3) ^ 2"] = "can't compute vec3(1, 2, 3) ^ 2; use its components",
      ["vec3(1, 2, 3) % 2"] = "can't compute vec3(1, 2, 3) % 2; use its components",
      ["vec3(1, 2, 3) < vec3(4, 5, 6)"] = "vec3 values have no order; compare their lengths or components",
      ["vec3(1, 2, 3) <= vec3(4, 5, 6)"] = "vec3 values have no order; compare their lengths or components",
      ["#vec3(1, 2, 3)"] = "a vec3 has no #; its length is v:length()",
      ["vec3(1, 2, 3).size"] = 'a vec3 has no "size"; it has x, y, z, dot, cross, length, normalized and lerp',
      ["vec3(1, 2, 3):dot()"] = "v:dot(w) needs a vec3, not nil",
      ["vec3(1, 2, 3):cross(2)"] = "v:cross(w) needs a vec3, not 2",
      ["vec3(1, 2, 3).length()"] = "v:length() needs a vec3, not nil",
      ["vec3(1, 2, 3):lerp(vec3(0, 0, 0))"] = "v:lerp(w, t) needs a number t, not nil",
      ["vec3(1, 2)"] = "vec3 needs three numbers, vec3(0, 1, 0); one is nil",
      ["vec3(1, 'two', 3)"] = "vec3 needs three numbers, vec3(0, 1, 0); one is a string",
      ["vec3 {1, 2}"] = "vec3 needs three numbers, vec3(0, 1, 0); one is nil",
    } do
      assert.equal(expected, fault(expression))
    end
  end)
end)
