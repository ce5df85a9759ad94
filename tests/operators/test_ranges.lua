-- Attributes used as parameters: refused like constants, with the node, the point and the frame.
local scene = require "testing.scene"

local function message(chain, columns, frames)
  return scene.error(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0, 1, 0}, {0, 2, 0}}, %s } }
  %s :solve {}]]):format(columns, chain), { frames = frames or {1, 2} })
end

describe("an attribute out of range", function()
  local shape = "shape = rapid.shape.plane { offset = -9 }"

  it("is refused as the constant is, by every node that takes one", function()
    for _, case in ipairs {
      {":collide { " .. shape .. ", %s }", "collide1", "bounce", "-0.1", "from 0 to 1"},
      {":collide { " .. shape .. ", %s }", "collide1", "bounce", "1.5", "from 0 to 1"},
      {":collide { " .. shape .. ", %s }", "collide1", "friction", "-2", "at least 0"},
      {":collide { " .. shape .. ", %s }", "collide1", "radius", "-0.01", "at least 0"},
      {":contact { radius = 0.1, %s }", "contact1", "bounce", "1.001", "from 0 to 1"},
      {":contact { radius = 0.1, %s }", "contact1", "friction", "-1e-06", "at least 0"},
      {":contact { %s }", "contact1", "radius", "-1", "at least 0"},
      {":drag { %s }", "drag1", "linear", "-3", "at least 0"},
      {":spring { %s }", "spring1", "stiffness", "-3", "at least 0"},
      {":interact { radius = 1, %s }", "interact1", "alignment", "-3", "at least 0"},
    } do
      local chain, node, name, value, right = unpack(case)
      local constant = message(chain:format(("%s = %s"):format(name, value)), "", {1, 1})
      assert.truthy(constant:find(("%s = %s is out of range; it must be %s"):format(name, value, right), 1, true),
        constant)
      local attribute = message(chain:format(('%s = rapid.attr "own"'):format(name)),
        ("own = {0, %s, 0}"):format(value))
      assert.truthy(attribute:find(('node "%s": point 1, frame 2: %s = %s (its attribute "own") is out of range; it ' ..
        "must be %s"):format(node, name, value, right), 1, true), attribute)
    end
  end)

  it("is refused where it is no number", function()
    scene.folder:write("nan.csv", "id,Px,Py,Pz,own\n0,0,0,0,0\n1,0,1,0,0\n2,0,2,0,nan\n")
    for _, name in ipairs { "bounce", "friction", "radius" } do
      local text = scene.error(('return rapid.create { points = rapid.points.read "nan.csv" } ' ..
        ':collide { %s, %s = rapid.attr "own" } :solve {}'):format(shape, name), { frames = {1, 2} })
      assert.truthy(text:find(('node "collide1": point 2, frame 2: %s = %%-?nan '):format(name)), text)
    end
  end)

  it("is refused of mass and pscale, which nodes read by themselves", function()
    for _, value in ipairs { "0", "-1" } do
      local text = message((':points("set", function(p) if p.id == 1 then p.mass = %s end end) :spring {}')
        :format(value), "mass = {1, 1, 1}")
      assert.truthy(text:find(('node "spring1": point 1, frame 2: mass = %s is out of range; it must be above 0')
        :format(value), 1, true), text)
    end
    local text = message(':points("set", function(p) p.pscale = -0.5 end) :collide { ' .. shape .. " }",
      "pscale = {1, 1, 1}")
    assert.truthy(text:find('node "collide1": point 0, frame 2: pscale = -0.5 is out of range; it must be at least 0',
      1, true), text)
    assert.truthy(message("", "mass = {1, -1, 1}"):find("mass = -1 is out of range; it must be above 0", 1, true))
  end)

  it("is refused in the frame in which an action writes it", function()
    local text = message((':action("harden", function(p) p.own = 2 end) :collide { %s, bounce = rapid.attr "own" }')
      :format(shape), "own = {1, 1, 1}")
    assert.truthy(text:find('node "collide1": point 0, frame 2: bounce = 2 ', 1, true), text)
  end)

  it("is ignored outside the group, as is an infinite mass", function()
    local points = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0, 1, 0}}, own = {0.5, 7},
    mass = {1, math.huge} } }
  :group { name = "some", where = function(p) return p.id == 0 end } :gravity {} :spring {}
  :collide { shape = rapid.shape.plane { offset = -9 }, bounce = rapid.attr "own", group = "some" }
  :solve {}]], { frames = {2, 2} })[2]
    assert.equal(2, #points)
  end)
end)
